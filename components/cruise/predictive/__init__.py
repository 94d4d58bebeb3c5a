"""Predictive cruise control: a problem over a horizon, solved at every sample by a fixed number of steps."""
