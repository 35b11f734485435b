"""The ME microresonator: its coefficients by annealing, its responses, harmonics and hysteresis."""
