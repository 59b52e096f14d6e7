"""What is concluded from the least residuals: uncertainty, identifiability, verdict."""
