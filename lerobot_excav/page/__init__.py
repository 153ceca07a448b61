"""A local web page from which a person points and drives, and its server; knows no simulation."""
