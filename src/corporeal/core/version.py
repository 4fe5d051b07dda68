"""Which version this is; part of the name of everything that is kept on disk."""

__version__ = "0.1.0"
