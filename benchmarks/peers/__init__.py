"""ScanTruss and what a user would pick instead, side by side: every run a process of its own, measured against the truth."""
