"""The verbs of the command line as functions; `import upright as up` offers them by name."""
