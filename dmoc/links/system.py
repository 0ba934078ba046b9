"""Several bodies that links hold together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dmoc.basics.arguments import checked, entries, number, of_kind, short
from dmoc.basics.docstrings import Named
from dmoc.basics.records import dataclass
from dmoc.configurations.rigid import checked_inertia
from dmoc.links.holonomic import Holonomic

# Names of bodies are listed in messages and written beside curves.
LONGEST_NAME = 40


@dataclass(frozen=True)
class Member(Named):
    """A body of a system: a point mass, or with an inertia a rigid body.

    Parameters
    ----------
    name : str
        What links, actuators and ends call it.
    mass : float
        [kg].
    inertia : 3 floats or 3x3 floats, optional
        In body axes about its centre of mass [kg m^2], principal moments or a matrix.
    """

    name: str
    mass: float
    inertia: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.isidentifier() or len(self.name) > LONGEST_NAME:
            raise ValueError(
                f"Member: name must be a word of letters, digits and _, at most {LONGEST_NAME} of them; "
                f"got {short(self.name)}"
            )
        checked(self, mass=number(f"Member: mass of {self.name}", self.mass, "kg", positive=True))
        if self.inertia is not None:
            checked(self, inertia=checked_inertia(self.inertia))


@dataclass(frozen=True)
class System(Named):
    """Bodies that move together, held by links: the first argument of a `TransferProblem` in place of a mass.

    Parameters
    ----------
    bodies : sequence of Member
    links : sequence of Holonomic
        Rods, rails and surfaces, which name the bodies that they hold.
    """

    bodies: Sequence[Member]
    links: Sequence[Holonomic] = ()

    def __post_init__(self) -> None:
        bodies, links = entries(self.bodies) or (), entries(self.links)
        if not bodies or links is None:
            raise ValueError(f"System: bodies and links must be lists; got {short(self.bodies)}")
        for i, body in enumerate(bodies):
            of_kind(f"System: bodies[{i}]", body, Member)
        names = [body.name for body in bodies]
        if len(set(names)) < len(names):
            raise ValueError(f"System: each body needs a name of its own; got {', '.join(names)}")
        for i, link in enumerate(links):
            of_kind(f"System: links[{i}]", link, Holonomic)
            for name in link.holds:
                if name not in names:
                    raise ValueError(
                        f"System: {type(link).__name__} (link {i + 1}) holds {short(name)}; the bodies are "
                        f"{', '.join(names)}"
                    )
        checked(self, bodies=tuple(bodies), links=tuple(links))

    @property
    def mass(self) -> float:
        """Of all bodies [kg]."""
        return float(sum(body.mass for body in self.bodies))

    @property
    def turns(self) -> bool:
        """Whether one of its bodies turns."""
        return any(body.inertia is not None for body in self.bodies)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(body.name for body in self.bodies)
