"""The loop in time: absolute deadlines, a process of its own, and what this machine can hold."""
