"""Static loops of an identified model: refitted, or corrected, where their error hides a cause."""
