"""The nominal model re-fitted to the records, before any mechanism is added."""
