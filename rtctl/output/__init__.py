"""What the program writes for people: atomic files, HTML pages, progress."""
