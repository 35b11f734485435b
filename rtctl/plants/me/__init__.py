"""The magnetoelectric resonator as a kind of plant."""
