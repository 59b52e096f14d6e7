"""The study that a person would write for a log, drafted from what the log shows."""
