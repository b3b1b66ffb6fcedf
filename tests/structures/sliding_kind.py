"""The kind of sliding decks: what stages ask of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from tests.structures.sliding import (
    Float,
    SlidingDeck,
    SlidingResponse,
    respond_sliding,
    varied_decks,
)

from rockframe import ParameterError
from rockframe.options.respond import Ensemble
from rockframe.oscillators.ensemble import bridge_draws, bridge_ensemble
from rockframe.rocking import EnsembleResponse, Margin, as_ground, draws, quantiles
from rockframe.rocking.assessments import Bands, FirstOverturning, RobustMargin
from rockframe.rocking.margins.ensemble import shaken
from rockframe.rocking.margins.members import correlations_of
from rockframe.structures.contract import Compared, Parameter, Shaking

#: A deck does not fall at any scale.
NEVER: Final = FirstOverturning(*(math.nan,) * 4, (), math.nan, 0)


@dataclass(frozen=True)
class SlidingKind:
    """The kind of `SlidingDeck`."""

    name: str = "sliding"
    quantities: tuple[str, ...] = ("residual_u",)

    def parameters(self, structure: SlidingDeck) -> list[Parameter]:
        return [Parameter("friction", "coefficient of friction", structure.friction)]

    def why_not(self, _structure: SlidingDeck, motion: Any) -> str:
        return "" if not hasattr(motion, "x") else "not computed for both directions"

    def require_possible(self, structure: SlidingDeck, ensemble: Ensemble | None) -> None:
        if ensemble is not None and ensemble.members:
            self.members(structure, ensemble)

    def members(self, structure: SlidingDeck, ensemble: Ensemble) -> list[SlidingDeck]:
        return varied_decks(structure, bridge_draws(bridge_ensemble(ensemble))["friction"])

    def most_critical(self, structures: Sequence[SlidingDeck], count: int) -> list[SlidingDeck]:
        return list(structures[:count])

    def respond(self, structures: Sequence[SlidingDeck], shaking: Shaking) -> list[SlidingResponse]:
        ground = as_ground(shaking.motion)  # type: ignore[arg-type]
        responses = [respond_sliding(structure, ground) for structure in structures]
        if shaking.options.margins != "none":
            ensemble = shaking.options.ensemble
            rows = self.margins(structures, [ground], ensemble)
            responses = [
                replace(one, margin=margin) for one, margin in zip(responses, rows[0], strict=True)
            ]
        if shaking.options.histories == "all":
            return responses
        return [replace(one, time=np.empty(0), u=np.empty(0)) for one in responses]

    def ensembles(
        self,
        structures: Sequence[SlidingDeck],
        motions: Sequence[Any],
        ensemble: Ensemble,
        versions: Sequence[Any],
    ) -> list[list[EnsembleResponse]]:
        peaks = self.member_peaks(structures, motions, [1.0], ensemble, versions)["peak"]
        drawn = {"friction": np.array(bridge_draws(bridge_ensemble(ensemble))["friction"])}
        return [
            [
                EnsembleResponse(
                    ensemble.members,
                    None,
                    0,
                    None,
                    Bands({"peak_u": tuple(quantiles(each[0]).tolist())}),
                    correlations_of(each[0], drawn),
                )
                for each in row
            ]
            for row in peaks
        ]

    def history(self, structure: SlidingDeck, motion: Any) -> SlidingResponse:
        return respond_sliding(structure, motion)

    def peaks(
        self, structures: Sequence[SlidingDeck], motions: Sequence[Any], scales: Sequence[float]
    ) -> dict[str, Any]:
        grounds = [as_ground(motion) for motion in motions]
        return _peaks(
            [
                [
                    [respond_sliding(one, g.scaled(scale)).peak_u for scale in scales]
                    for one in structures
                ]
                for g in grounds
            ]
        )

    def member_peaks(
        self,
        structures: Sequence[SlidingDeck],
        motions: Sequence[Any],
        scales: Sequence[float],
        ensemble: Ensemble,
        versions: Sequence[Any],
    ) -> dict[str, Any]:
        grounds, of_member = shaken(motions, ensemble, versions)
        amplitude = draws(ensemble)[:, 3].tolist()
        return _peaks(
            [
                [
                    [
                        [
                            respond_sliding(member, grounds[k].scaled(scale * factor)).peak_u
                            for member, k, factor in zip(
                                self.members(one, ensemble), row.tolist(), amplitude, strict=True
                            )
                        ]
                        for scale in scales
                    ]
                    for one in structures
                ]
                for row in of_member
            ]
        )

    def quantities_of(
        self, _structures: Sequence[SlidingDeck], peak: Float, _speed: Float
    ) -> dict[str, Float]:
        return {"peak_u": peak}

    def has(self, _structure: SlidingDeck, quantity: str) -> bool:
        return quantity == "peak_u"

    def margins(
        self, structures: Sequence[SlidingDeck], motions: Sequence[Any], ensemble: Ensemble | None
    ) -> list[list[Margin]]:
        robust = None if ensemble is None else RobustMargin(*(math.nan,) * 6, 0)
        return [[Margin(NEVER, 10.0, robust) for _ in structures] for _ in motions]

    def resized(self, structure: SlidingDeck, dimension: str, _value: float) -> SlidingDeck:
        raise ParameterError(f"sliding deck {structure.name!r} has no {dimension}.")

    def sliders(self, _structure: SlidingDeck) -> dict[str, float | str]:
        return {}

    def compared(self, structure: SlidingDeck, _motion: Any) -> Compared:
        raise ParameterError(f"sliding deck {structure.name!r} is not compared.")


def _peaks(peak: Any) -> dict[str, Any]:
    values = np.array(peak)
    return {
        "verdict": np.ones(values.shape, dtype=np.int8),
        "peak": values,
        "speed": np.full(values.shape, np.nan),
    }


SLIDING: Final = SlidingKind()
