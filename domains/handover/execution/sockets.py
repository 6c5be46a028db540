"""What execution needs from the world: `Perception` and `Arm`, to be filled by a real robot or by the simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mlnlite.domains.handover.kinematics.pose import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Hand and face as somebody saw them.

    Attributes:
        time: when [s].
        hand: position of the palm, shape (3,) [m].
        face: position of the face, shape (3,) [m].
    """

    time: float
    hand: FloatArray
    face: FloatArray


class Perception(Protocol):
    """Eyes."""

    def look(self, time: float) -> Sight | None:
        """What is seen at a time [s]; None if hand or face is lost. A sight may be older than the time."""
        ...


class Arm(Protocol):
    """A robot arm with a gripper, commanded in small steps."""

    def joints(self) -> FloatArray:
        """Configuration now, shape (n,) [rad]."""
        ...

    def move(self, q: FloatArray) -> None:
        """Goes to a near configuration, shape (n,) [rad], within one step of time."""
        ...

    def grip(self, closed: bool) -> None:
        """Closes or opens the gripper."""
        ...

    def pulled(self) -> bool:
        """Whether somebody pulls at the object."""
        ...
