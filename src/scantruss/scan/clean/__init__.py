"""Cleaning a scan, one module a step: what Sec. 2.2 of the paper leaves to the scanner's software; `steps.clean_points` does them all."""
