"""Models of growing richness, each kept only if it predicts better."""
