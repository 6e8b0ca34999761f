"""A payload of two bodies with a hinge: noticed from motion, its axis found, the bodies told apart."""
