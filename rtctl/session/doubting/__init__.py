"""A run, recorded or under way, against its model: what the watch finds, and what is done about it."""
