"""Writing, reading and comparing pictures."""
