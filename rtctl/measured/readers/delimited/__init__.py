"""Text files with columns: their bytes as UTF-8 lines, the form of their lines, and how they end."""
