"""The grid and what improves it (Sec. 4)."""
