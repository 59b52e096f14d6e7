"""A log: look at it, doubt it, draft its study, find its law."""
