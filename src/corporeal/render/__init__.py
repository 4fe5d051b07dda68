"""Pictures of triangles."""
