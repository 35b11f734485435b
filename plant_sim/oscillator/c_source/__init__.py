"""An oscillator with its mechanisms as C."""
