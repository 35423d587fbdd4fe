"""A bounding volume hierarchy of eight boxes a node."""
