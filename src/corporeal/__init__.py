"""Gives reconstructed scenes a body: what each point is made of, and how it all moves."""

__version__ = "0.1.0"
