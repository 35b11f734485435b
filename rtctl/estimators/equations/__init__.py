"""Where a user's equations rest, and how they move: what a filter and a tuning need of them."""
