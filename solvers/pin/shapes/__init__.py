"""The shapes that a bore or an outside may have."""
