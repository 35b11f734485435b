"""Wires: every driver speaks `rtctl.border.records.Driver` and knows neither plant nor controller."""
