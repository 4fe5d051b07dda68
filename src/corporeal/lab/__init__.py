"""Evaluation and corpora."""
