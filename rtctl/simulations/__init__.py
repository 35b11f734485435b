"""Identified models as simulations, for fits and diagnosis, built from rtctl's own read-outs."""
