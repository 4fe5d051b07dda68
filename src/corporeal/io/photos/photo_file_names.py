"""Names of files and folders of photographs."""

READABLE_IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp")
"""Pictures that are read."""
HEIC_SUFFIXES = (".heic", ".heif")
"""Photographs that phones take; they are not read, but known for what they are."""
UNREAD_IMAGE_SUFFIXES = (".tif", ".tiff", ".gif", ".bmp", ".avif", ".jxl", ".dng", ".cr2", ".cr3", ".nef", ".arw")
"""Pictures of other kinds and of raw sensors, the same."""
IMAGE_FOLDERS = ("images", "", "input", "rgb", "images_2", "images_4", "images_8")
"""Folders that pictures lie in, beside their poses."""
MASK_FOLDERS = ("masks", "mask")
INSTANCE_FOLDERS = ("instances", "objects")
"""Folders of masks of objects, and of each by number, beside pictures."""
