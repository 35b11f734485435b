"""Identification by linear regression: the weak form and what it needs."""
