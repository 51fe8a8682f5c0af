"""What stands between the network and the application: nothing of it knows what a run is."""
