"""Data types, errors, stored results, plug-in registry, progress and terminal output."""
