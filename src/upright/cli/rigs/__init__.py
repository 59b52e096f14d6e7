"""Commands of two words that begin with rig."""
