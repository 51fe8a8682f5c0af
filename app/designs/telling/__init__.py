"""What pages and reports say of a run: names in words, inputs, verdicts, captions, what shaped an answer."""
