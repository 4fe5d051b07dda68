"""What files and folders of photographs are called."""

SHOWN = (".png", ".jpg", ".jpeg", ".webp")
"""Pictures that are read."""
HEIC = (".heic", ".heif")
"""Photographs that telephones take; they are not read, but known for what they are."""
OTHERS = (".tif", ".tiff", ".gif", ".bmp", ".avif", ".jxl", ".dng", ".cr2", ".cr3", ".nef", ".arw")
"""Pictures of other kinds and of raw sensors, the same."""
IMAGES = ("images", "", "input", "rgb", "images_2", "images_4", "images_8")
"""Folders that pictures lie in, beside their poses."""
MASKS = ("masks", "mask")
INSTANCES = ("instances", "objects")
"""Folders of masks of objects, and of each by number, beside pictures."""
