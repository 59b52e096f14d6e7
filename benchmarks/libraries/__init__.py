"""The same pendulum and the same loop, as a user of each library would write them.

Every module offers `trajectory()` and `ensemble()`; each returns a function without arguments, ready to be timed.
"""
