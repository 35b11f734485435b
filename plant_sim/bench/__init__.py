"""A served device on a test bench: faults on purpose, and an account of what it really does."""
