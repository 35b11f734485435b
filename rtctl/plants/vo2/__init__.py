"""The VO2 actuator as a kind of plant."""
