"""`jaxsat local`."""
