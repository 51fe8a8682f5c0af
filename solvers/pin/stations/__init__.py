"""Stations along the bar: panels with Lobatto nodes, and extrema between nodes."""
