"""Photographs: images, masks, camera poses of COLMAP and transforms.json."""
