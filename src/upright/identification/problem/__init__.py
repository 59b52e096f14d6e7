"""From runs and unknowns to residuals and their derivatives."""
