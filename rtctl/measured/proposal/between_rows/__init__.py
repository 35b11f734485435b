"""What the drive does between its rows: what a file says of it, and what its course shows."""
