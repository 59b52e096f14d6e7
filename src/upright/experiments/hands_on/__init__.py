"""The experiments with hands on a rig: supervised runs of RIG.toml, then the same fits, designs and chapters."""
