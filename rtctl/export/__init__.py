"""Models, controllers and runs in forms that other programs take."""
