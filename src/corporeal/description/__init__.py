"""The stage ``describe``: materials from an annotation file, from names, or from a model."""
