"""`jaxsat check`."""
