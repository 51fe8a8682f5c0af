"""What people read, in their language: names, captions, verdicts, drawings. Pages and reports share it."""
