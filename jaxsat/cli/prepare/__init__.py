"""`jaxsat prepare`."""
