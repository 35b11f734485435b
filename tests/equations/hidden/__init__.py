"""Effects hidden in systems of equations by an integration that shares no code with the program."""
