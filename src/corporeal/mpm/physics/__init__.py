"""Reference formulas of the method in float64 NumPy."""
