"""How far a model is from a dataset: each record simulated in one free run, and whether it can be predicted at all."""
