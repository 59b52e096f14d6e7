"""Experiment 2: hold the pendulum upright."""
