"""The composite hysteresis model in self-sensing feedback of a VO2 microactuator, on three simulated devices."""
