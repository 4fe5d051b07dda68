"""What the names in files and of objects say, in any language."""
