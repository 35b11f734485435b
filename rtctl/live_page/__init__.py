"""The live page of a run: a process of its own that reads what a run records and shows it in a browser.

`recorded → shown → served`: rows of a run, growing or finished; what a page draws of them; the page over HTTP. The loop
knows nothing of it: rows are read from the recording, changes go through the run's control socket.
"""
