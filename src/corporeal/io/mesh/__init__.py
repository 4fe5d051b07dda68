"""Mesh formats: OBJ, PLY, STL, OFF, 3MF, DAE."""
