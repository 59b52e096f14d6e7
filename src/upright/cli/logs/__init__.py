"""The log of a run: `upright log show`, `tail`, `recover`, `convert`, `replay`."""
