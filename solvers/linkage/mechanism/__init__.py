"""The four-bar itself: types, lengths, angular velocities, closure."""
