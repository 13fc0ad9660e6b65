"""The studio: from scan to structure in a browser; all but `server` and `view` does without one."""
