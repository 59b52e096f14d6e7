"""The experiments that can be made, by name: the paper's, declared in their folders, and those of other packages."""

from __future__ import annotations

from upright.declared import Declared, declared_in
from upright.experiments.stand.experiment import Experiment

EXPERIMENTS: Declared[Experiment] = Declared(
    "experiment", "upright.experiments", declared_in(Experiment, "upright.experiments"),
    lambda value: isinstance(value, Experiment),
)  # fmt: skip
"""In the order in which they are run and reported."""
