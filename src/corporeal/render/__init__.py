"""Rendering of triangle meshes and Gaussians to images and videos."""
