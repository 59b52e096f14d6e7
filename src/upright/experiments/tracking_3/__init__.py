"""Experiment 3: follow a step through a flexible shaft."""
