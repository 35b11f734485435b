"""The control loop: exchange, estimate, control, limit, command, record."""
