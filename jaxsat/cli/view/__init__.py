"""`jaxsat view`."""
