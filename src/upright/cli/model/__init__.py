"""A model: identify it, test it, grow it."""
