"""How far can the model be trusted that a result rests on? No verdict is better than that of its model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeVar

T = TypeVar("T")

NOT_TRUSTED, RESERVED, TRUSTED = LEVELS = ("not trusted", "with reservations", "trusted")
"""From the worst to the best."""
SIMULATED = "SIMULATED: no rig was driven."
REPLAYED = "REPLAYED from a record: no rig was driven."
NOT_SUPPORTED = "not supported"
"""What stands where a probability would, of a rig whose model is not trusted."""
REFUSAL = "Do not rely on this: its model is not trusted."


@dataclass(frozen=True, kw_only=True)
class Basis:
    """The model that a result rests on.

    Attributes
    ----------
    level : str
        One of `LEVELS`.
    sentence : str
        What the model's own verdict says, or where its parameters come from where it has none.
    """

    level: str
    sentence: str

    @property
    def trusted(self) -> bool:
        """Whether nothing of the model stands against a verdict that rests on it."""
        return self.level == TRUSTED

    @property
    def supports(self) -> bool:
        """Whether a probability of the rig can be given: simulations of a model that is not trusted tell of none."""
        return self.level != NOT_TRUSTED

    def supported(self, value: T) -> T | str:
        """A probability, or a text of one, where the model supports it; `NOT_SUPPORTED` elsewhere."""
        return value if self.supports else NOT_SUPPORTED

    def qualified(self, verdict: str) -> str:
        """A verdict that is no better than its model; one that says so already stays as it is."""
        refused = self.level == NOT_TRUSTED and not verdict.startswith(REFUSAL)
        return f"{REFUSAL} {verdict}" if refused else verdict

    def first_line(self, performed: str = "") -> str:
        """What stands before everything else that a result says: how it was `performed`, then the model's verdict."""
        refusal = REFUSAL if self.level == NOT_TRUSTED else ""
        return " ".join(filter(None, (performed, refusal, "" if self.trusted else self.sentence)))

    def plain(self) -> dict[str, str]:
        """As a file of results holds it; see `of_plain`."""
        return {"level": self.level, "sentence": self.sentence}

    def __and__(self, other: Basis) -> Basis:
        """Both together: the level of the worse, and what each says that is not better than reserved."""
        worse = min(self, other, key=lambda b: LEVELS.index(b.level))
        sentences = dict.fromkeys(b.sentence for b in (self, other) if not b.trusted or worse.trusted)
        return Basis(level=worse.level, sentence=" ".join(sentences))


DESCRIBED = Basis(level=RESERVED, sentence="Parameters as described, not identified.")
"""Numbers that somebody gave, such as those of a study, a data sheet or plain matrices."""
MEASURED = Basis(level=TRUSTED, sentence="Measured on the rig; no model enters.")


def of_plain(content: Any, what: str) -> Basis:
    """The basis that a file holds, which is called so, such as "this design"; without one it counts as not trusted."""
    if isinstance(content, dict):
        level, sentence = content.get("level"), content.get("sentence")  # type: ignore[reportUnknownMemberType]
        if level in LEVELS and isinstance(sentence, str):
            return Basis(level=level, sentence=sentence)
    return Basis(level=NOT_TRUSTED, sentence=f"{what[:1].upper()}{what[1:]} does not say whether it can be trusted.")


def in_percent(share: float) -> str:
    """A share in percent that is called 100 or 0 % only where it is whole: 0.997 is 99.7 %, and 0.9997 above 99.9 %."""
    if share in (0.0, 1.0):
        return f"{100 * share:.0f} %"
    if share > 0.999:
        return "above 99.9 %"
    if share < 0.001:
        return "below 0.1 %"
    return f"{100 * share:.1f} %" if not 0.01 <= share <= 0.99 else f"{100 * share:.0f} %"
