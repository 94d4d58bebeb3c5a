"""Scenarios, lines and rolling stock: data, no code."""
