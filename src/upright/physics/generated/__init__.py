"""Equations of motion of the built-in plants, generated."""
