"""Whole jobs on a device: closed and open loop, acquisition, replay, latency, recovery."""
