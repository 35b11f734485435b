"""Elements that several figures share: style, axes, decimation, PNG files."""
