"""A rig that moves in a page: its kernel, and what draws and pushes it there. Which scripts does a page need?"""
