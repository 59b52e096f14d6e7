"""How does the rig answer a sine, and which numbers does that fix? Experiment 1b.

`detection` finds what is at a known frequency, `spectra` estimates a response from any log, `balance` puts measured
periodic motion into the equations of motion, `fitting` looks for the numbers that make both sides meet.
"""
