"""Proof that the exported loop computes what Python computes: inputs, programs that take them, comparison of bits."""
