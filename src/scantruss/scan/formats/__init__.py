"""The formats of scans: one file per format, reading and writing side by side."""
