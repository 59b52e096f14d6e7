"""Pages of any kind, as HTML, as PDF, on a terminal; above it, the chapters of fit, ladder, law and log."""
