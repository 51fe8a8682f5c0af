"""Results at many angles and sections, for comparison and for optimizers that know nothing of the subject."""
