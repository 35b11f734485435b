"""The dataset manifest: its schema, the signals of each kind of plant, findings."""
