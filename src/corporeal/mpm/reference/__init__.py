"""The engine in float64 NumPy that the fast ones are checked against."""
