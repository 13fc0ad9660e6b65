"""What leaves the program: the table of formats, then one file per format."""
