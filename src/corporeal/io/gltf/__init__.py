"""glTF and GLB: reading, writing, skins, Draco compression."""
