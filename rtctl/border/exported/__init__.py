"""What a model is to other programs: C source, differential equations."""
