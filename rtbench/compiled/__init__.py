"""A kernel instantiated: in an arithmetic, over a layout, in a loop."""
