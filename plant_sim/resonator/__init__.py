"""The magnetoelectric resonator and its lock-in bench."""
