"""Measuring: what the machine is, whether it is quiet, and how long a test takes on it."""
