"""`jaxsat completion`."""
