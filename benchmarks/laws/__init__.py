"""Experiments with known answers: one file per family of laws; ``suite`` lists the cases."""
