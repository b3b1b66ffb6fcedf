"""The settings of the page, and the response to them with the samples that the page draws."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from rockframe.cells import DASH, decimal
from rockframe.errors import ParameterError, require_known
from rockframe.matching.record_pulses import find_pulses
from rockframe.options.pulse import PulseOptions
from rockframe.options.respond import Ensemble, RespondOptions
from rockframe.quantities import PEAKS, QUANTITIES, Quantity
from rockframe.record import Record
from rockframe.results.versions import Uncertain
from rockframe.rocking import (
    EnsembleResponse,
    GroundAcceleration,
    Response,
    Verdict,
    Versions,
    with_envelope,
)
from rockframe.rocking.verdict import Strip
from rockframe.structures.contract import (
    Shaking,
    Structure,
    StructureResponse,
    kind_named,
    kind_of,
)
from rockframe.study.kinds import KINDS
from rockframe.units import GRAVITY
from rockframe.wavelets.pulse import Pulse
from rockframe.web import deck_path, drawn_shape, strip_svg, tone

if TYPE_CHECKING:
    from rockframe.wobbling import PairAcceleration

#: Largest scale of the ground motion [1].
_LARGEST_SCALE: Final = 100.0
_NUMBERS: Final = ("scale", "from", "to")
_SWITCHES: Final = ("vertical", "pulse")
#: A setting that is a word or a number.
_SECTION: Final = "section"


@dataclass(frozen=True)
class Settings:
    """A structure, a motion, and the window of time that is shown.

    Parameters
    ----------
    structure : Structure
        The structure.
    record : str
        Identifier of the record.
    scale : float
        Factor on the accelerations of the record [1].
    vertical : bool
        True if the vertical component is included.
    pulse : bool
        True if only the record's pulse shakes the structure horizontally.
    window : (float, float)
        Start and end of the time that is drawn in full detail [s].
    """

    structure: Structure
    record: str
    scale: float
    vertical: bool
    pulse: bool
    window: tuple[float, float]


def read_settings(given: Mapping[str, str]) -> Settings:
    """Return the settings that a request states.

    Parameters
    ----------
    given : mapping of str to str
        ``record``; ``kind`` of the structure, by default rocking, and the sliders of this kind: of
        frames ``height`` and ``width`` of a column [m], ``mass_ratio``, ``restitution_factor`` [1],
        and ``section``: rectangular, circular, or an inertia ratio [1]; ``scale`` [1];
        ``vertical`` and ``pulse``: 0 or 1; ``from`` and ``to`` [s].

    Raises
    ------
    ParameterError
        If a setting is missing, unknown, not a number, or out of range.

    Examples
    --------
    >>> wide = {"record": "A", "height": "9.6", "width": "1.6", "mass_ratio": "4", "scale": "1",
    ...         "restitution_factor": "1", "section": "rectangular", "vertical": "0",
    ...         "pulse": "0", "from": "0", "to": "60"}
    >>> read_settings(wide).structure.mass_ratio
    4.0
    >>> read_settings({**wide, "scale": "nought"})
    Traceback (most recent call last):
    rockframe.errors.ParameterError: Invalid scale 'nought'. Must be a finite number.
    """
    kind = _kind(given.get("kind", "rocking"))
    sliders: Sequence[str] = kind.slider_names
    names = ("record", *_SWITCHES, *sliders, *_NUMBERS)
    for name in names:
        if name not in given:
            raise ParameterError(f"Missing setting {name!r}. State each setting once.")
    for name in given:
        require_known("setting", name, (*names, "kind"))
    numbers = {
        name: _number(name, given[name]) for name in (*sliders, *_NUMBERS) if name != _SECTION
    }
    scale = numbers["scale"]
    if not 0.0 < scale <= _LARGEST_SCALE:
        raise ParameterError(
            f"Invalid scale {scale!r}. Must be above 0 and at most {_LARGEST_SCALE:g}."
        )
    for name in _SWITCHES:
        if given[name] not in ("0", "1"):
            raise ParameterError(f"Invalid {name} {given[name]!r}. Must be 0 or 1.")
    values: dict[str, float | str] = {name: numbers[name] for name in sliders if name in numbers}
    if _SECTION in sliders:
        section = given[_SECTION]
        values[_SECTION] = _number(_SECTION, section) if section[:1].isdigit() else section
    return Settings(
        structure=kind.of_sliders(values),
        record=given["record"],
        scale=scale,
        vertical=given["vertical"] == "1",
        pulse=given["pulse"] == "1",
        window=(numbers["from"], numbers["to"]),
    )


def _kind(name: str) -> Any:
    """Return the kind of a name, if the page shows structures of it."""
    shown = [each for each in KINDS if hasattr(kind_named(each), "of_sliders")]
    require_known("kind", name, shown)
    return kind_named(name)


def _number(name: str, text: str) -> float:
    try:
        return decimal(text)
    except ValueError:
        raise ParameterError(f"Invalid {name} {text!r}. Must be a finite number.") from None


Float = NDArray[np.float64]
Places = NDArray[np.intp]

#: Largest number of samples that are all drawn; of longer records, only extremes are drawn.
_DRAWN: Final = 12_000
#: Number of intervals whose extremes are drawn: within the window, and before and after it.
_INSIDE: Final = 1_000
_OUTSIDE: Final = 200


#: The page shows the selected pulse only, without the test against noise.
PULSE_SEARCH: Final = PulseOptions(surrogates=0, runners_up=0)


@dataclass(frozen=True, eq=False)
class ExploredMotion:
    """A record to choose on the page, or both components of a station.

    Parameters
    ----------
    record : Record
        The record, for its names; of both components, the first one with the name of the motion.
    ground : GroundAcceleration or PairAcceleration
        Acceleration of the ground, with the vertical component of the station if available.
    search : PulseOptions, optional
        Options of the search for the pulse; None if the record has no usable period.
    uncertain : Uncertain, optional
        The record and the data of its versions, if it has several.
    """

    record: Record
    ground: GroundAcceleration | PairAcceleration
    search: PulseOptions | None = PULSE_SEARCH
    uncertain: Uncertain | None = None

    @property
    def in_both(self) -> bool:
        """Return True for a motion in both directions."""
        return not isinstance(self.ground, GroundAcceleration)

    @property
    def has_vertical(self) -> bool:
        """Return True if a vertical component was recorded beside it."""
        if isinstance(self.ground, GroundAcceleration):
            return self.ground.vertical is not None
        return self.ground.z is not None


#: Numbers of rocking frames, and of all structures, that the page shows.
_OF_FRAMES: Final = (
    *("height", "width", "inertia_ratio", "slenderness", "size", "frequency_parameter"),
    *("effective_frequency_parameter", "restitution", "uplift_acceleration"),
)
_OF_ALL: Final = ("mass_ratio", "restitution_factor")


@dataclass(frozen=True, eq=False)
class Answer:
    """A response, and the samples to draw.

    Parameters
    ----------
    response : StructureResponse
        The computed response.
    ground : GroundAcceleration or PairAcceleration
        The motion that caused it.
    places : array, shape (drawn,)
        Indices of the samples to draw, increasing: all samples of a short record, otherwise the
        extremes of rotation, lift and acceleration in many intervals.
    pulse : Pulse, optional
        The unscaled pulse of the record, if the pulse alone shakes the structure.
    """

    response: Any
    ground: GroundAcceleration | PairAcceleration
    places: Places
    pulse: Pulse | None = None

    @property
    def acceleration(self) -> Float:
        """Horizontal acceleration [m s-2]; in both directions, the length of its vector."""
        return _acceleration(self.ground)

    def facts(self) -> dict[str, Any]:
        """Return verdict, peaks and parameters as JSON values in SI units; None if undefined."""
        response, structure = self.response, self.response.structure
        verdict, kind = response.spread_verdict, kind_of(structure)
        properties = kind.parameters(structure)
        of_structure = {
            name: getattr(structure, name)
            for name in _OF_FRAMES + _OF_ALL
            if hasattr(structure, name)
        }
        of_structure |= {each.name: each.value for each in properties}
        shape, words = drawn_shape(of_structure)
        numbers = of_structure | {
            name: getattr(response, name, np.nan)  # columns that roll have no impacts
            for name in (
                *(quantity.name for quantity in PEAKS),
                *("uplift_time", "overturning_time", "impacts"),
            )
        }
        shown = [*PEAKS, *(QUANTITIES[name] for name in kind.quantities)]
        finite = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
        return {
            "verdict": response.verdict.name.lower(),
            "tone": tone(verdict),
            "words": f"nominally {verdict.words}",
            "unusual": words,
            "properties": [
                [each.label, f"{each.value:.4g} {each.units.removeprefix('1')}".strip()]
                for each in properties
            ],
            **finite,
            **shape,
            "peaks": [[f"nominal {quantity.symbol}", self._peak(quantity)] for quantity in shown],
            "pulse_words": None if self.pulse is None else _words(self.pulse),
            "path": self._path(),
            "series": list(self._series()),
            "pga": float(np.abs(self.acceleration).max()),
            "step": self.ground.time_step,
            "gravity": GRAVITY,
            "samples": int(response.time.size),
            "drawn": int(self.places.size),
        }

    def _path(self) -> str:
        """Return the path of the deck seen from above, under a motion in both directions."""
        if isinstance(self.ground, GroundAcceleration):
            return ""
        response = self.response
        return deck_path(response.theta, response.u_x, response.u_y, response.frame.slenderness)

    def _series(self) -> dict[str, Float]:
        """Return the samples to draw, by name: see `packed`."""
        response, places = self.response, self.places
        series = {
            "time": response.time[places],
            "acceleration": self.acceleration[places],
            **{name: np.asarray(getattr(response, name))[places] for name in ("theta", "u", "v")},
        }
        in_one_plane = isinstance(self.ground, GroundAcceleration)
        return series if in_one_plane else series | {"phi": response.phi[places]}

    def _peak(self, quantity: Quantity) -> str:
        """Return a peak with its unit; a dash if the structure overturns."""
        if self.response.verdict is Verdict.OVERTURNS:
            return DASH
        return (
            f"{quantity.text(getattr(self.response, quantity.name))} {quantity.shown_unit}".rstrip()
        )

    def table(self) -> str:
        """Return all samples as CSV, in s, m/s2, rad and m; cells are empty after overturning."""
        response, ground = self.response, self.ground
        series = {"time_s": response.time, "acceleration_m_s2": self.acceleration}
        moves = {"theta_rad": response.theta, "u_m": response.u, "v_m": response.v}
        if not isinstance(ground, GroundAcceleration):
            series |= {"acceleration_x_m_s2": ground.x, "acceleration_y_m_s2": ground.y}
            moves |= {"phi_rad": response.phi, "u_x_m": response.u_x, "u_y_m": response.u_y}
        series |= moves
        lines = [
            ",".join("" if np.isnan(x) else f"{x:.9g}" for x in row)
            for row in zip(*series.values(), strict=True)
        ]
        return "\n".join([",".join(series), *lines, ""])

    def packed(self) -> bytes:
        """Return the values as one line of JSON, then the samples to draw as little-endian float32.

        The arrays follow one another: time [s], acceleration [m s-2], theta [rad], u and v [m], NaN
        after overturning; in both directions also phi [rad], NaN while the columns stand upright.
        The line is padded to a multiple of four bytes.
        """
        line = json.dumps(self.facts(), allow_nan=False).encode("ascii")
        head = line + b" " * (3 - len(line) % 4) + b"\n"
        return head + np.stack([*self._series().values()]).astype("<f4").tobytes()


def _acceleration(ground: GroundAcceleration | PairAcceleration) -> Float:
    if isinstance(ground, GroundAcceleration):
        return ground.acceleration()
    return np.hypot(ground.x, ground.y)


def answer(motions: Mapping[str, ExploredMotion], settings: Settings) -> Answer:
    """Compute the response of the structure to the motion.

    Parameters
    ----------
    motions : mapping of str to ExploredMotion
        Motions by the identifiers of their records.
    settings : Settings
        Settings of the request.

    Raises
    ------
    ParameterError
        If the record is unknown, lacks the requested vertical component or a pulse, or accelerates
        downwards faster than gravity; if columns are not circular under both components, or differ.
    """
    scaled = _ground_motion(motions, settings)
    structure = _possible(settings, scaled)
    response: Any = kind_of(structure).history(structure, scaled)
    pulse = _pulse_of(motions[settings.record]) if settings.pulse else None
    return Answer(response, scaled, _places(response, scaled, settings.window), pulse)


def margin(motions: Mapping[str, ExploredMotion], settings: Settings) -> dict[str, Any]:
    """Compute the ensemble and the margin (some tenths of a second), and return verdict, bands and
    strip.

    Parameters
    ----------
    motions, settings
        As in `answer`, which raises the same errors.
    """
    ground = _ground_motion(motions, settings)
    structure = _possible(settings, ground)
    if not isinstance(ground, GroundAcceleration):
        response, ensemble = _rolling(structure, ground)
        assert response.margin is not None  # noqa: S101 -- the options request it
        # of columns that roll, no scale of the structure as given is searched
        strip = replace(response.margin.strip, nominal_to=0.0)
        return _told(response, ensemble, strip) | {"envelope": None}
    kind, options = kind_of(structure), Ensemble()
    nominal: Any = kind.history(structure, ground)
    versions = _versions(motions[settings.record], settings)
    [[robust]] = kind.margins([structure], [ground], options)
    [[ensemble]] = kind.ensembles([structure], [ground], options, [versions])
    # kinds whose responses have no envelope show the nominal history only
    drawn = hasattr(nominal, "theta_low")
    envelope = _envelope(with_envelope(nominal, ground, versions=versions)) if drawn else None
    response = replace(nominal, margin=robust, ensemble=ensemble)
    return _told(response, ensemble, robust.strip) | {"envelope": envelope}


def _possible(settings: Settings, ground: GroundAcceleration | PairAcceleration) -> Structure:
    """Return the structure of the settings, if its kind computes it under the motion.

    Frames say themselves which columns do not roll.
    """
    structure = settings.structure
    kind: Any = kind_of(structure)
    reason = "" if _SECTION in kind.slider_names else kind.why_not(structure, ground)
    if reason:
        raise ParameterError(
            f"Invalid record {settings.record!r} for this structure: {reason}. Must be in one "
            "plane."
        )
    return structure


def _rolling(
    structure: Structure, ground: PairAcceleration
) -> tuple[StructureResponse, EnsembleResponse]:
    """Return the response to a motion in both directions with its margin, and the ensemble."""
    kind = kind_of(structure)
    [response] = kind.respond([structure], Shaking(ground, RespondOptions(histories="none")))
    [[ensemble]] = kind.ensembles([structure], [ground], Ensemble(), [None])
    return replace(response, ensemble=ensemble), ensemble  # type: ignore[type-var]


def _told(response: StructureResponse, ensemble: EnsembleResponse, strip: Strip) -> dict[str, Any]:
    """Return verdict, strip and bands."""
    return {
        "tone": tone(response.spread_verdict),
        "words": response.spread_verdict.sentence,
        "strip": strip_svg(strip),
        "bands": ensemble.facts(),
    }


def _versions(motion: ExploredMotion, settings: Settings) -> Versions | None:
    """Return the versions of the motion of the settings, if the record has several."""
    ground = motion.ground
    if settings.pulse or motion.uncertain is None or not isinstance(ground, GroundAcceleration):
        return None
    ground = ground if settings.vertical else replace(ground, vertical=None)
    return motion.uncertain.versions(Ensemble(), ground).scaled(settings.scale)


#: Number of intervals of time with the extremes of an envelope, and largest theta / alpha in it.
_INTERVALS: Final = 2_000
_FURTHEST: Final = 3.0


def _envelope(response: Response) -> dict[str, list[float]]:
    """Return the envelope in intervals of time: starts [s], lowest and highest theta [rad]."""
    length = -(-response.time.size // _INTERVALS)
    starts = np.arange(0, response.time.size, length)
    most = _FURTHEST * response.frame.slenderness
    low = np.minimum.reduceat(np.asarray(response.theta_low), starts)
    high = np.maximum.reduceat(np.asarray(response.theta_high), starts)
    series = {"time": response.time[starts], "low": low, "high": high}
    return {
        name: np.round(np.clip(values, -most, most) if name != "time" else values, 6).tolist()
        for name, values in series.items()
    }


def _ground_motion(
    motions: Mapping[str, ExploredMotion], settings: Settings
) -> GroundAcceleration | PairAcceleration:
    """Return the ground motion of the settings."""
    require_known("record", settings.record, motions)
    motion = motions[settings.record]
    ground = motion.ground
    if settings.vertical and not motion.has_vertical:
        raise ParameterError(
            f"Invalid vertical '1' of record {settings.record!r}. Must be 0: no vertical was "
            "recorded beside it."
        )
    if not isinstance(ground, GroundAcceleration):
        if settings.pulse:
            raise ParameterError(
                f"Invalid pulse '1' of record {settings.record!r}. Must be 0: a motion in both "
                "directions has no pulse."
            )
        return (ground if settings.vertical else replace(ground, z=None)).scaled(settings.scale)
    if not settings.vertical:
        ground = replace(ground, vertical=None)
    if settings.pulse:
        samples = _pulse_of(motion).acceleration(motion.record.time)
        alone = GroundAcceleration.from_samples(samples, motion.record.time_step)
        ground = replace(ground, coefficients=alone.coefficients)
    return ground.scaled(settings.scale)


@cache
def _pulse_of(motion: ExploredMotion) -> Pulse:
    """Return the pulse that `rockframe pulse` selects; the search takes some tenths of a second."""
    if motion.search is None:
        raise ParameterError(
            f"Invalid pulse '1' of record {motion.record.record_id!r}. Must be 0: it has no usable "
            "periods in which a pulse could be found."
        )
    pulses = find_pulses(motion.record, options=motion.search)
    return pulses.matches[pulses.used].pulse


def _words(pulse: Pulse) -> str:
    kind = pulse.wavelet.replace("_", " ")
    return f"{kind}, a_p {pulse.a_p / GRAVITY:.3f} g, T_p {pulse.T_p:.3g} s"


def _places(
    response: Any,
    ground: GroundAcceleration | PairAcceleration,
    window: tuple[float, float],
) -> Places:
    count = response.time.size
    if count <= _DRAWN:
        return np.arange(count)
    standing = response.theta.size
    if response.verdict is Verdict.OVERTURNS:
        standing = int(np.isfinite(response.theta).sum())
    theta, lift = np.nan_to_num(response.theta), np.nan_to_num(response.v)
    series = (theta, lift, _acceleration(ground))
    first, last = np.searchsorted(response.time, window)
    first, last = max(0, int(first) - 1), min(count, int(last) + 1)
    parts = ((0, first, _OUTSIDE), (first, last, _INSIDE), (last, count, _OUTSIDE))
    # Always draw the last sample before the fall and the first after it, where the curves end.
    ends = np.array([0, standing - 1, min(standing, count - 1), count - 1])
    chosen = [_extremes(values, *part) for part in parts for values in series]
    places: Places = np.unique(np.concatenate([ends, *chosen]))
    return places


def _extremes(values: Float, start: int, stop: int, intervals: int) -> Places:
    """Return the indices of the extremes in each of equal intervals; all if they are few."""
    length = max(1, (stop - start) // intervals)
    if length <= 2:
        return np.arange(start, stop)
    whole = (stop - start) // length * length
    rows = values[start : start + whole].reshape(-1, length)
    starts = start + length * np.arange(rows.shape[0])
    rest = np.arange(start + whole, stop)
    return np.concatenate([starts + rows.argmin(axis=1), starts + rows.argmax(axis=1), rest])
