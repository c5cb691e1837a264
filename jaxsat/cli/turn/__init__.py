"""`jaxsat turn`."""
