"""Experiment 2b: swing the pendulum up and catch it."""
