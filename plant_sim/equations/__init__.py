"""Models that a user writes as equations: language, units, compilation, simulation."""
