"""Benches: every number the README claims, re-made from seeds; dictionaries in the shape of `formats`."""
