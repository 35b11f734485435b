"""A functional mock-up unit of somebody as a simulated device."""
