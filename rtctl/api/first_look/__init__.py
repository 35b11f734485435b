"""The first look at measured data: a data file to a manifest, and a dataset as a table and a picture."""
