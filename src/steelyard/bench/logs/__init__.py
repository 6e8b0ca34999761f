"""Made logs: our methods and those of other packages, and a log a thousand times as long."""
