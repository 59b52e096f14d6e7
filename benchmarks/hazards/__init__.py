"""Ways to break a rig, and the rigs that are broken: `benchmarks.safety` puts them side by side."""
