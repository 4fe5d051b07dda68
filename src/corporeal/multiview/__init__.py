"""Geometry of several cameras: rays, silhouettes, ground plane and the vertical."""
