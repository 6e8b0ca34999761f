"""One page per job: each pipeline calls named rooms in order."""
