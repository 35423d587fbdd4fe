"""How rays walk through trees, one file a way."""
