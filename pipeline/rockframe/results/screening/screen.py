"""screen.nc: verdicts and peaks by record, structure and scale, and statistics of them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from rockframe.frame import RockingFrame
from rockframe.results.reading import opened
from rockframe.results.schema import SCREEN, SCREEN_NC
from rockframe.results.screening.histories import KeptHistory, append_histories
from rockframe.results.writing import CHUNK, COMPRESSED, as_os_error, named, put

Float = NDArray[np.float64]
Scenario = Mapping[str, NDArray[Any]]

_DIMS: Final = ("record", "structure", "scale")
_PEAKS: Final = ("peak_rotation_ratio", "peak_u", "peak_v", "peak_impact_velocity")


def write_screening(
    scenarios: Iterable[Scenario],
    shape: tuple[int, int, int],
    describe: Callable[[], tuple[Mapping[str, Any], Mapping[str, str]]],
    path: Path,
    *,
    input_sha256: Mapping[str, str],
    parameters: Mapping[str, Any],
    left_out: Mapping[str, str],
    filtered: Collection[str] = (),
    histories: Iterable[KeptHistory] | None = None,
) -> None:
    """Write the output of the screen stage, complete or not at all; one motion is in memory at a
    time.

    The same inputs give the same bytes.

    Parameters
    ----------
    scenarios : iterable of mapping of str to array, shape (structures, scales)
        The result of `peaks_of_frames` for each motion.
    shape : (int, int, int)
        Numbers of motions, structures and scales.
    describe : callable
        Called after the last motion; returns the values of the other variables, and the units of
        variables that allow two units.
    path : Path
        The file to write; an older file is replaced.
    input_sha256, parameters, left_out : mapping
        As in `Origin`.
    filtered : collection of str
        Names in `left_out` that the user's filters reject; the others could not be screened.
    histories : iterable of KeptHistory, optional
        Histories of single scenarios, read after the last motion.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    source = iter(scenarios)
    # Validate everything before creating a folder or a file.
    first = tuple(islice(source, 1))
    with named(path) as partial:
        with _filling(partial, shape) as fill:
            for row, scenario in enumerate(chain(first, source)):
                fill(row, scenario)
        kept = {} if histories is None else append_histories(partial, histories)
        values, units = describe()
        put(
            SCREEN_NC.dataset({**values, **kept}, **units).assign_attrs(
                filtered=json.dumps(sorted(filtered))
            ),
            partial,
            SCREEN,
            input_sha256=input_sha256,
            parameters=parameters,
            left_out=left_out,
            mode="a",
        )


@contextmanager
def _filling(
    partial: Path, shape: tuple[int, int, int]
) -> Iterator[Callable[[int, Scenario], None]]:
    """Yield a function that writes the scenarios of one motion."""
    records, structures, scales = shape
    width = min(scales, CHUNK)
    rows = max(1, min(records, CHUNK // (structures * width)))
    file = netCDF4.Dataset(partial, "w", format="NETCDF4")
    try:
        for dimension, size in zip(_DIMS, shape, strict=True):
            file.createDimension(dimension, size)
        for name in ("verdict", *_PEAKS):
            like = SCREEN_NC[name].holding(np.empty((0, 0, 0)))
            created = file.createVariable(
                name,
                like.dtype,
                _DIMS,
                chunksizes=(rows, structures, width),
                fill_value=np.nan if like.dtype.kind == "f" else None,
                chunk_cache=2 * 8 * rows * structures * width,
                **COMPRESSED,
            )
            created.setncatts(like.attrs)

        def fill(row: int, scenario: Scenario) -> None:
            with as_os_error():
                for name in ("verdict", *_PEAKS):
                    file[name][row] = scenario[name]

        yield fill
    finally:
        with as_os_error():
            file.close()


def peaks_of_frames(
    frames: Sequence[RockingFrame],
    verdict: NDArray[np.int8],
    peak_rotation: Float,
    impact_velocity: Float,
) -> dict[str, NDArray[Any]]:
    """Return the variables of scenarios: ``verdict``, ``peak_u`` and so on.

    Ratios of tendons and gaps are 0 for structures without them; these ratios are not written.

    Parameters
    ----------
    frames : sequence of RockingFrame
        The structures.
    verdict, peak_rotation, impact_velocity : array, shape (structures, scales)
        Results for one motion [1, rad, m s-1].
    """
    alpha = np.array([[frame.slenderness] for frame in frames])
    u, v, tendons, gaps = (np.zeros_like(peak_rotation) for _ in range(4))
    for k, frame in enumerate(frames):
        u[k] = np.abs(frame.horizontal_displacement(peak_rotation[k]))
        if frame.abutment is not None:
            gaps[k] = u[k] / frame.abutment.gap
        if frame.tendon is not None:
            stretch = 2.0 * frame.tie_lever * np.sin(0.5 * peak_rotation[k])
            force = frame.tendon.prestress + frame.tendon.stiffness * stretch
            tendons[k] = force / frame.tendon.yield_force
        v[k] = frame.vertical_displacement(np.minimum(peak_rotation[k], frame.beam.angle))
    ratio = peak_rotation / alpha
    peaks = (ratio, u, v, impact_velocity)
    ratios = {"peak_tendon_ratio": tendons, "peak_gap_ratio": gaps}
    return {"verdict": verdict, **dict(zip(_PEAKS, peaks, strict=True)), **ratios}


def limited_in(frame: RockingFrame, quantity: str) -> bool:
    """Return True if a quantity exists for a frame; some need a tendon that yields, or a gap."""
    if quantity == "tendon_ratio":
        return frame.tendon is not None and frame.tendon.yield_force < math.inf
    return quantity != "gap_ratio" or frame.abutment is not None


def read_screening(path: str | Path, *, every_scale: bool = True) -> xr.Dataset:
    """Read the output of the screen stage.

    Parameters
    ----------
    path : str or Path
        Output of ``rockframe screen``.
    every_scale : bool
        Read verdicts and peaks at every scale; False reads the reference scale only, to save
        memory.

    Returns
    -------
    xarray.Dataset
        Everything except histories, which `read_screen_history` reads one at a time. ``record_id``
        is a coordinate: after ``.set_index(record="record_id")`` records are selected by name.

    Raises
    ------
    InputError
        If the file is missing, corrupted, or of another kind.

    Examples
    --------
    >>> read_screening("no-such-file.nc")
    Traceback (most recent call last):
    rockframe.errors.InputError: no-such-file.nc: no such file. Must be a screen file.
    """
    with opened(Path(path), SCREEN) as dataset:
        known = dataset.drop_dims("obs", errors="ignore")
        if not every_scale:
            scale = float(known["reference_scale"])
            at = int(np.flatnonzero(known["scale"].values == scale)[0])
            some = [name for name in ("verdict", *_PEAKS) if name in known]
            known = known.assign({name: known[name].isel(scale=at, drop=True) for name in some})
        return known.load().set_coords("record_id")
