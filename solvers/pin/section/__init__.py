"""One section of the bar: strength, least wall, flexibility."""
