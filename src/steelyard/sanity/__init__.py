"""Sanity: is the log what its description says, and does the answer look like one?"""
