"""What records of a vo2 are for: staircases that show the static loops, and records that show the heating."""
