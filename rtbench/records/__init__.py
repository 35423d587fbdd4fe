"""Runs as files: writing, reading, deriving tables from them, comparing them."""
