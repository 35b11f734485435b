"""Verification of the chosen set on test records and against nonparametric alternatives."""
