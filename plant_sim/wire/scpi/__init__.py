"""Simulated source meters in front of a device, and a voltmeter beside it, that speak SCPI or TSP on a wire."""
