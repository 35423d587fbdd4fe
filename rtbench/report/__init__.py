"""Tables and plots from records: reads runs, writes files, measures nothing and needs no numba."""
