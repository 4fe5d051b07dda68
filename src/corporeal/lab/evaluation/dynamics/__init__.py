"""Evaluation of motion: methods against a finer simulation and against measurements."""
