"""Units as text, and quantities with a unit."""
