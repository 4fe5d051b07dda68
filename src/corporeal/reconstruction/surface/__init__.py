"""Closed surfaces of objects from Gaussians and photographs, and their acceptance checks."""
