"""A run while it lasts: how it goes, and changes from outside."""
