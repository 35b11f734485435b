"""The equation of motion: its terms and the states of its mechanisms."""
