"""Gaussian splats: training, rasterisation, deformation."""
