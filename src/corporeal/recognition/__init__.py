"""Recognition of materials and constructions from names, in any language."""
