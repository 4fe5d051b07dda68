"""Formulas of the method in float64 NumPy, to be trusted."""
