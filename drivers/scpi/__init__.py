"""Driver of source meters that speak text: SCPI, or the TSP of Keithley, by a table of commands."""
