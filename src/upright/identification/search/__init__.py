"""The search for the numbers with the least residuals, and where it starts."""
