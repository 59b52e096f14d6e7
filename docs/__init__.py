"""What of the documentation is computed: `python -m docs` does it, `python -m docs --check` says what no longer holds."""
