"""How a kind of plant is controlled: the protocol, and that of plants without a model."""
