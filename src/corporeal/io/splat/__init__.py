"""Gaussian splat formats: PLY, SPLAT, KSPLAT, SPZ, SOG."""
