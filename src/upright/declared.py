"""Readers, export targets, drivers of rigs, plants and experiments by name: this package's, and installed ones'.

A thing of this package declares itself: it is an object in a module of its kind's room, and nothing else lists it.
One of somebody else's package is an entry point, ``[project.entry-points."upright.readers"]`` in its pyproject.toml;
its code is trusted as any installed package's is, and loaded when it is first needed.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, TypeVar

from upright.errors import BadInput, nearest

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Declaration:
    """What a thing says of itself first.

    Attributes
    ----------
    order : int
        Its place in lists, the smallest first.
    """

    name: str
    order: int = 50


D = TypeVar("D", bound=Declaration)


class Declared(Mapping[str, T]):
    """Things of one kind by name, this package's first; asking for names loads nothing of other packages.

    Parameters
    ----------
    what : str
        One of them, for sentences: ``"reader"``.
    group : str
        Entry points that declare more of them.
    own : callable
        This package's by name, collected once, when first needed.
    accepts : callable
        Whether an object is one of them.
    """

    def __init__(
        self, what: str, group: str, own: Callable[[], Mapping[str, T]], accepts: Callable[[Any], bool]
    ) -> None:
        self.what, self.group, self._own, self._accepts = what, group, own, accepts
        self._loaded: dict[EntryPoint, T] = {}

    @cached_property
    def own(self) -> Mapping[str, T]:
        """Those of this package."""
        return self._own()

    @property
    def _entries(self) -> Mapping[str, EntryPoint]:
        return {n: e for n, e in _entry_points(self.group, tuple(sys.path)).items() if n not in self.own}

    def __iter__(self) -> Iterator[str]:
        yield from self.own
        yield from self._entries

    def __len__(self) -> int:
        return len(self.own) + len(self._entries)

    def __contains__(self, name: object) -> bool:
        return name in self.own or name in self._entries

    def __getitem__(self, name: str) -> T:
        """One of them.

        Raises
        ------
        KeyError
            When there is none of this name.
        BadInput
            When it is another package's and does not load; the sentence names the package.
        """
        return self.own[name] if name in self.own else self._load(self._entries[name])

    def named(self, name: str) -> T:
        """The same, refused in a sentence when there is none of this name."""
        if name not in self:
            raise BadInput(f"There is no {self.what} '{name[:60]}': {nearest(name, self)}")
        return self[name]

    def sound(self) -> dict[str, T]:
        """Those that load; a warning names the package of one that does not."""
        loaded, unsound = self._tried()
        for sentence in unsound:
            warnings.warn(sentence, stacklevel=2)
        return loaded

    def unsound(self) -> tuple[str, ...]:
        """Sentences about those that do not load."""
        return self._tried()[1]

    def _tried(self) -> tuple[dict[str, T], tuple[str, ...]]:
        loaded, unsound = dict(self.own), list[str]()
        for name, entry in self._entries.items():
            try:
                loaded[name] = self._load(entry)
            except BadInput as error:
                unsound.append(str(error))
        return loaded, tuple(unsound)

    def _load(self, entry: EntryPoint) -> T:
        if entry not in self._loaded:
            whose = f"the {self.what} '{entry.name}' of the package {entry.dist.name if entry.dist else 'that has it'}"
            try:
                value = entry.load()
            except Exception as error:  # whatever somebody else's code raises
                raise BadInput(
                    f"{whose} does not load ({type(error).__name__}: {error}); mend the package or uninstall it."
                ) from error
            if not self._accepts(value):
                raise BadInput(f"{whose} is none: {entry.value} is of {type(value).__name__}; see CONTRIBUTING.md.")
            self._loaded[entry] = value
        return self._loaded[entry]


@lru_cache(maxsize=32)
def _entry_points(group: str, path: tuple[str, ...]) -> dict[str, EntryPoint]:
    """Entry points by name; `path` is the one that they are found on, so that they are looked for anew when it changes.

    Of two packages that give the same name, the one that is found first has it, as with modules.
    """
    from importlib.metadata import entry_points  # a tenth of a second that --help need not wait for

    return {entry.name: entry for entry in reversed(tuple(entry_points(group=group)))}


def declared_in(kind: type[D], *rooms: str) -> Callable[[], dict[str, D]]:
    """What gathers the declarations of a kind that stand in the modules of packages, in their order."""

    def gather() -> dict[str, D]:
        values: list[D] = []
        for room in rooms:
            for module in iter_modules(import_module(room).__path__):
                inside = vars(import_module(f"{room}.{module.name}")).values()
                values += (value for value in inside if isinstance(value, kind))
        return {one.name: one for one in sorted(values, key=lambda one: (one.order, one.name))}

    return gather
