"""`jaxsat config`."""
