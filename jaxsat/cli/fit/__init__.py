"""`jaxsat fit`."""
