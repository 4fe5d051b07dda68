"""Scenes made of Gaussians: drawing them, learning them from pictures, deforming them."""
