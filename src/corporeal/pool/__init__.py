"""The asset pool: what scenes are made of."""
