"""The test stand that experiments are written against: a twin that is simulated here, or a rig that is driven."""
