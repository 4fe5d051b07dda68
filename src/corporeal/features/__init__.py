"""What pictures and points look like to a model, or to no model: features to find parts by."""
