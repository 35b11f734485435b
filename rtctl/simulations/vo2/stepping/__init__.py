"""A VO2 model that keeps its state from one step to the next: what is translated for other people's simulators."""
