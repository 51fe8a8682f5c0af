"""Hand calculations: formulas, substituted numbers and results, step by step."""
