"""The piston in its cylinder: contact of the skirt and friction."""
