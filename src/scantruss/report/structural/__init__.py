"""The report of a structure that people read: one list of parts, as HTML and as PDF."""
