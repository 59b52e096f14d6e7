"""Boards of vendors, each behind its own kit, which is imported when such a board is opened.

None of these ports has met a board yet: they show which call goes where. Whoever has one runs the conformance tests
(`tests/rigs/conformance.py`) on it with the motor unplugged before anything else.
"""
