"""The influence of effects, estimated before they are solved."""
