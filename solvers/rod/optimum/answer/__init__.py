"""What is told of an optimum: sensitivities, or why there is none."""
