"""Charts, and the plots shared by all kinds."""
