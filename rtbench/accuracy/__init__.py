"""Exact answers to ray/triangle questions, and a filter with a proven bound in front of them."""
