"""What files and folders of photographs are called."""

SHOWN = (".png", ".jpg", ".jpeg", ".webp")
"""Pictures that are read."""
IMAGES = ("images", "", "input", "rgb", "images_2", "images_4", "images_8")
"""Folders that pictures lie in, beside their poses."""
