"""From photographs without poses, or a film, to a COLMAP model."""
