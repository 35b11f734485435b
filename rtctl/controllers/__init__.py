"""Controllers: setpoint and estimate in, command levels and their terms out; one method a file."""
