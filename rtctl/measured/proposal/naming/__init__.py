"""What names and units of columns say."""
