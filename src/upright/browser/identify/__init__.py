"""Screen Identify: logs that were kept or brought, and their fits."""
