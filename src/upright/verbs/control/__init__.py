"""Verbs that close a loop: `design`, `regulate`, `swing_up` and `track`."""
