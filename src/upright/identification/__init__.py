"""What its parameters are: studies of logs, fits of a plant to them, and how sure that is."""
