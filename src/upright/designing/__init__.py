"""From an identified rig to gains, and what they are worth."""
