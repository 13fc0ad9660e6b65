"""The boundary of the scan: ordered loops, smooth curves and corners."""
