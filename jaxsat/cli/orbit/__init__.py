"""`jaxsat orbit`."""
