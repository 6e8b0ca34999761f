"""The masses of parts: priors on their densities, materials, uneven parts, doubtful shapes."""
