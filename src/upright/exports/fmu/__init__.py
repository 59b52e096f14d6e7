"""An identified rig as a unit for co-simulation (FMI 3.0): sources in C, their description, and both in one archive."""

from upright.exports.fmu.archive import archive
from upright.exports.fmu.unit import Unit, unit_of

__all__ = ["Unit", "archive", "unit_of"]
