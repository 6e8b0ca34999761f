"""Data files of all kinds as named columns: text, NPZ, Parquet, bags."""
