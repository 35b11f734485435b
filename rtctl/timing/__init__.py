"""Time as the loop sees it: clocks, real-time scheduling, histograms of durations."""
