"""Equations as compiled kernels: trees to source in terms of numbered variables, laws, integrators bound to them."""
