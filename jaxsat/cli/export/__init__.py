"""`jaxsat export`."""
