"""Models of a rig: identified, grown, asked what they predict."""
