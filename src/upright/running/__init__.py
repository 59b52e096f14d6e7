"""A law on a rig that is there: in virtual time, or by the clock on the wall."""
