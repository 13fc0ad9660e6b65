"""Scans larger than memory."""
