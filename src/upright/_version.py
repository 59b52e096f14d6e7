"""Version of this package, which the build reads too."""

__version__ = "1.0.0rc1"
