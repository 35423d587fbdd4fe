"""Ray/triangle tests, one file a published method, and the contract they keep."""
