"""The version, which is part of the keys of stored results."""

__version__ = "0.1.0"
