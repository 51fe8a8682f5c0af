"""What drives the piston: pressure over the crank angle and the axial force it makes."""
