"""A pool of 3D models that scenes are composed of."""
