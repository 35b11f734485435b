"""The page over HTTP: who may read and write, the stream of rows, any range of them, changes of the run."""
