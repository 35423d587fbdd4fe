"""Which rows and columns each kind of run has as a table."""
