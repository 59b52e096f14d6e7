"""Experiment 1b: how a rig answers a sine, and which numbers that fixes.

`detection` finds what is at a known frequency, `spectra` estimates a response from any log, `balance` puts measured
periodic motion into the equations of motion, `fitting` looks for the numbers that make both sides meet.
"""
