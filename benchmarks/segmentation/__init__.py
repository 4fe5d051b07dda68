"""Segmentation of parts and of objects, against ground truth that rendered models and settled scenes give."""
