"""The oscillator as a kind of plant."""
