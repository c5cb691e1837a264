"""Profile likelihoods: the cost along one parameter, all others at their best."""
