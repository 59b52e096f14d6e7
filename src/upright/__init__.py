"""What does a laboratory rig weigh, and why does it move as it does?

One Lagrangian per plant; simulation, linear models, identification and reports follow from it.
"""

from __future__ import annotations

from upright.errors import BadInput, ImpossiblePhysics, NotIdentifiable, UprightError
from upright.quantities import quantity

__version__ = "0.1.0"

__all__ = [
    "BadInput",
    "ImpossiblePhysics",
    "NotIdentifiable",
    "UprightError",
    "__version__",
    "quantity",
]
