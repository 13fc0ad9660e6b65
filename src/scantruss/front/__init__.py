"""The advancing front: start, advance and close."""
