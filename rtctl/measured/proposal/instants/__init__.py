"""What tells the instants of the samples: a time column, a rate, and what the stamps are."""
