"""Dynamics evaluated: methods against a finer run and against life, measured alike."""
