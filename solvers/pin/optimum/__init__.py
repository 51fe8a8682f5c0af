"""The lightest walls at given stations, with a proven bound."""
