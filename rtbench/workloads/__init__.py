"""Where triangles and rays come from."""
