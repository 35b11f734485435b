"""Identified models as simulations: what a fit and a diagnosis move, made of rtctl's own read-outs."""
