"""The control loop as compiled blocks of steps that hold no interpreter lock."""
