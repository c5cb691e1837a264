"""`jaxsat simulate`."""
