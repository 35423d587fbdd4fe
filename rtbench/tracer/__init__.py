"""The ray tracer that simulates only the effects a scene calls for."""
