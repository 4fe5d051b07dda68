"""Which points belong together: objects, and parts of objects."""
