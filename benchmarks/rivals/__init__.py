"""Tasks that rtctl and what a user would pick instead do side by side, each on its own home ground too."""
