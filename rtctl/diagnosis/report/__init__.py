"""The answer as JSON, TOML, HTML and pictures."""
