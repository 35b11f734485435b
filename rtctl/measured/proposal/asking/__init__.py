"""Guesses put to a person as questions, and what of the answers is a guess that was taken."""
