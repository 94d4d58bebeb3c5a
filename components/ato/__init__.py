"""Automatic train operation: controllers that learn from trip to trip, and their rivals."""
