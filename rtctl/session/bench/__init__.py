"""A simulated device on a test bench: its account, recorded like a run, and its page."""
