"""An identified VO2 model as C."""
