"""What a leaf of a tree may hold beside triangles: sphere, cone, disc, plane."""
