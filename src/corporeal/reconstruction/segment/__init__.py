"""Segmentation of Gaussians and points into objects and parts."""
