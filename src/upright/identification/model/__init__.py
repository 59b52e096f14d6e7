"""The rig with known and unknown numbers, the runs that speak about them, and the fit."""
