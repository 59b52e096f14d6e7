"""Linear models as they are handed over, and design of a loop around one."""
