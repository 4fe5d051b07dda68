"""Which points belong together: things, and parts of things."""
