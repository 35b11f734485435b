"""What concerns files of every format: what their first bytes say, columns of their matrices."""
