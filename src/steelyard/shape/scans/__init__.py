"""From posed views to a cloud, step by step: the table, poses that agree, the surface, what is left out."""
