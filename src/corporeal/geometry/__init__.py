"""Triangle meshes: queries, sampling, rays, repair."""
