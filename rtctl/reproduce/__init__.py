"""The papers' studies on our plants: every table and figure of a paper beside ours, also where ours are worse."""
