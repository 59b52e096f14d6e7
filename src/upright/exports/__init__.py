"""What was designed or identified, for a loop that runs elsewhere: a law as a program, a rig as a simulator's model."""
