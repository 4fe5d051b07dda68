"""Many scenes: planned, assembled, run and reported."""
