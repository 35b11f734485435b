"""Identification of oscillators: weak form, output error, annealing, tone records."""
