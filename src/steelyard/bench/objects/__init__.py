"""Object folders as `bench held-object`, `materials` and `part-coverage` use them: cases, bound, summaries, tables."""
