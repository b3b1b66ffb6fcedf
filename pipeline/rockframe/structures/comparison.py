"""Comparison of a freely rocking bridge with restrained, hybrid, isolated and monolithic ones.

The same quantities are computed for all: drift and lift of the deck, base shear over the weight of
deck and columns, and the time until which the assumptions of the model hold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from rockframe.errors import ParameterError
from rockframe.frame import RockingFrame
from rockframe.options.respond import BridgeEnsemble
from rockframe.record import Record
from rockframe.rivals import FixedFrame, IsolatedDeck
from rockframe.rocking.excitation import GroundAcceleration
from rockframe.rocking.margins.members import Versions
from rockframe.structures.contract import Compared, kind_of
from rockframe.wavelets.pulse import Pulse


@dataclass(frozen=True)
class Rivals:
    """The models of one bridge.

    Parameters
    ----------
    frame : RockingFrame
        The free frame, with a beam and without restraints.
    restrained, hybrid : RockingFrame, optional
        The frame with tendons; the frame with tendons and dissipaters.
    isolated : IsolatedDeck, optional
        The deck on isolators and rigid piers.
    fixed : FixedFrame, optional
        The frame with columns fixed to the ground and the deck.

    Raises
    ------
    ParameterError
        If the frame has no beam, or is restrained.
    """

    frame: RockingFrame
    restrained: RockingFrame | None = None
    hybrid: RockingFrame | None = None
    isolated: IsolatedDeck | None = None
    fixed: FixedFrame | None = None

    def __post_init__(self) -> None:
        if not self.frame.mass_ratio > 0.0:
            raise ParameterError(
                f"Frame {self.frame.name!r} is a column without a beam. Only frames with a "
                "mass_ratio above 0 can be compared with other bridges."
            )
        if self.frame.restrained:
            raise ParameterError(
                f"Frame {self.frame.name!r} has tendons or dissipaters. State it without them: "
                "they belong to the restrained and hybrid models."
            )

    @property
    def models(self) -> dict[str, RockingFrame | IsolatedDeck | FixedFrame]:
        """Models of the bridge, by name."""
        others = {name: getattr(self, name) for name in RIVALS if getattr(self, name) is not None}
        same = {"mass_ratio": self.frame.mass_ratio, "abutment": self.frame.abutment}
        return {
            "free": self.frame,
            **{name: replace(rival, **same) for name, rival in others.items()},
        }


#: Names of the models that a free frame is compared with.
RIVALS = ("restrained", "hybrid", "isolated", "fixed")


def compare(
    rivals: Rivals,
    motion: Record | Pulse | GroundAcceleration,
    ensemble: BridgeEnsemble | None = None,
    versions: Versions | None = None,
) -> list[Compared]:
    """Compute the responses of all models of a bridge to one motion.

    Parameters
    ----------
    rivals : Rivals
        The models of the bridge.
    motion : Record, Pulse or GroundAcceleration
        Ground acceleration, as for `respond`. Isolated and monolithic bridges ignore its vertical
        component.
    ensemble : BridgeEnsemble, optional
        Compute the responses of this ensemble of each model too, unless it has no members.
    versions : Versions, optional
        Versions of the motion, one of which shakes each member; by default the motion itself.

    Returns
    -------
    list of Compared
        One response for each model, the free frame first.

    Raises
    ------
    ParameterError
        If the motion is invalid, see `respond`, or a member of the ensemble is impossible.

    Examples
    --------
    >>> bent = RockingFrame(height=9.6, width=1.6, mass_ratio=4.0)
    >>> deck = IsolatedDeck.lead_rubber(strength_ratio=0.05, period=3.0)
    >>> pulse = Pulse(wavelet="symmetric_ricker", a_p=0.3 * 9.81, T_p=1.5)
    >>> [(one.model, round(one.peak_u, 2)) for one in compare(Rivals(bent, isolated=deck), pulse)]
    [('free', 0.29), ('isolated', 0.39)]
    """
    models = []
    for name, model in rivals.models.items():
        kind: Any = kind_of(model)
        compared = replace(kind.compared(model, motion), model=name)
        if ensemble is not None and ensemble.members:
            [[members]] = kind.ensembles([model], [motion], ensemble, [versions])
            compared = replace(compared, ensemble=members)
        models.append(compared)
    return models
