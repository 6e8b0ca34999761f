"""Rows that are no measurements, and rows of still poses."""
