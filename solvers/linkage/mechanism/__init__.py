"""The four-bar mechanism: types, lengths, angular velocities, closure."""
