"""A model as a functional mock-up unit (FMI 3.0 or 2.0) with its sources."""
