"""Evaluation and corpora: what measures the product; only the command line imports it."""
