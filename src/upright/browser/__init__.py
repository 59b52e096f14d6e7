"""The laboratory in a browser: rigs that run, one operator for each, and whoever looks on."""
