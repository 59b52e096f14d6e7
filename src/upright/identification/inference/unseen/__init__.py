"""What a fit promises of runs that it has not seen: how far it was tried, and bands around its predictions."""
