"""`jaxsat sensitivity`."""
