"""Machine code from the text of kernels: a small part of Python, lowered to LLVM's text, compiled by llvmlite alone."""
