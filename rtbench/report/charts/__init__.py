"""Charts of runs, one module a family; all import matplotlib and none pyplot."""
