"""Models of a rig: identified, grown, their predictions."""
