"""Pure array maths on points and triangles."""
