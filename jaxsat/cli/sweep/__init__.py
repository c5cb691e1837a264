"""`jaxsat sweep`."""
