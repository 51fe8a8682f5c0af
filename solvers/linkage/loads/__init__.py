"""What joints and crank carry."""
