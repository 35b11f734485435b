"""The language of equations: text to a tree of a few kinds of nodes; no text is ever evaluated as code."""
