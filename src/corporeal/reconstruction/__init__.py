"""From photographs or a splat to objects: what the stage ``reconstruct`` is put together from."""
