"""What a diagnosis found, in plain words."""
