"""The grid: the record and its tables."""
