"""Drivers of devices on a wire: each is a `rtctl.border.records.Driver` and knows neither plant nor controller."""
