"""Experiment 1a: stiffness and inertia of the first body."""
