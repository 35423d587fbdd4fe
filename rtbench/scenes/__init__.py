"""The scene model and its readers: TOML, NFF, mesh files."""
