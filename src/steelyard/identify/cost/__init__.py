"""The noise-aware cost, its derivatives, and the dense and linear algebra under it."""
