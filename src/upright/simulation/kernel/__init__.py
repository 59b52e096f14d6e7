"""The writer of compiled code: text of the kernel, piece by piece."""
