"""From photographs or a splat to objects: poses, masks, Gaussians, surfaces, segments."""
