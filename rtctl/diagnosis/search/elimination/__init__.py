"""Causes and laws that a chosen set does not need."""
