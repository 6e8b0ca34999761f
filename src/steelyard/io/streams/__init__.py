"""One stream of a log: what its entry says, its channels in SI, its clock, its rows that miss a number."""
