"""A loop: gains, and what becomes of them at the rig."""
