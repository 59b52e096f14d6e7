"""A rig in a minute: what is wired how, a fit, gains, and from hanging to upright, without a hand at it."""
