"""How far the re-fitted nominal model is from the records, and what of that is allowed."""
