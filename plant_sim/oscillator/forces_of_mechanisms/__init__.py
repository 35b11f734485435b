"""Forces of mechanisms that a model lacks: along its own motion, and along one that was measured."""
