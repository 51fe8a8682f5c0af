"""Middleware between the network and the application; independent of the domain."""
