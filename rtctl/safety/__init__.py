"""What may reach the device and what may be believed of it: limits, plausibility, guards."""
