"""Thin shells at their true thickness: triangle meshes whose vertices are particles (decision mpm-shells)."""
