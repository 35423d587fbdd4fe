"""Questions: each a module that puts workloads and methods together; configs say with what."""
