"""Stiffness and inertia from step responses with known loadings."""
