"""Properties of a single section of the bar: strength, minimum wall, flexibility."""
