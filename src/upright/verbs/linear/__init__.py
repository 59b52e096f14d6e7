"""Linear models as they are handed over, and what is asked of a loop around one."""
