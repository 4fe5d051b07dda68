"""USD: text, meshes and rigid bodies."""
