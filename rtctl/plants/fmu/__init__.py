"""A functional mock-up unit as a kind of plant."""
