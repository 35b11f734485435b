"""Campaigns: thousands of simulations from one file, on all cores or on a cluster, with one result."""
