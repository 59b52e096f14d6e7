"""Experiment 4: a large free swing."""
