"""Experiment 1b: the frequency response of the hanging rig."""
