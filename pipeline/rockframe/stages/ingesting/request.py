"""The files that an ingest reads, and what its options say of all of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final, Self

from rockframe.engines.pool import Limits
from rockframe.errors import RockframeWarning
from rockframe.ingest import Reading, Source, is_catalogue, read_catalogue, sources_of
from rockframe.ingest.collection import Claims, Owners, collect_sources, read_and_measured
from rockframe.ingest.options import read_options
from rockframe.options.ingest import Filters, IngestOptions, PassportLimits
from rockframe.outcome import InputOutcome
from rockframe.provenance import refuse_overwriting, sha256_of
from rockframe.results.tables.entries import refuse_strange_entries
from rockframe.results.writing import require_ending


@dataclass(frozen=True)
class Request:
    """The files that an ingest reads, and its options.

    Parameters
    ----------
    sources : tuple of Source
        Files of the request.
    options : IngestOptions
        Options of reading and processing.
    filters : Filters
        Filters of accepted records.
    """

    sources: tuple[Source, ...]
    options: IngestOptions
    filters: Filters

    @classmethod
    def of(
        cls,
        paths: Sequence[str | Path],
        options: IngestOptions,
        filters: Filters,
        outputs: Sequence[Path],
        *,
        look: bool = True,
    ) -> Self:
        """Return the request for files and folders, in which outputs are skipped.

        Without `look`, files are pending (`Source`).

        Raises
        ------
        InputError
            As `sources_of`, and if the catalogue cannot be read.
        """
        catalogue, columns = options.catalogue, options.catalogue_columns or ()
        entries = read_catalogue(catalogue, columns=columns) if catalogue else None
        return cls(tuple(sources_of(paths, entries, outputs, look=look)), options, filters)

    @cached_property
    def files_stated(self) -> Mapping[str, Path]:
        """The catalogues in use and the selection, by name."""
        given, selection = self.options.catalogue, self.options.selection
        files = {given.name: given} if given else _catalogues(self.sources)
        return files if selection is None else {**files, selection.name: selection}

    @cached_property
    def checks(self) -> PassportLimits:
        """Limits of the checks."""
        if self.options.limits is None:
            return PassportLimits()
        from rockframe.study.toml import read_limits  # few runs state limits

        return read_limits(self.options.limits)

    @cached_property
    def factors(self) -> dict[str, float] | None:
        """Factors of a selection by record; None without a selection."""
        if self.options.selection is None:
            return None
        from rockframe.stages.select import read_selection  # few runs state a selection

        return read_selection(self.options.selection)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """The options of the stage, as JSON values."""
        stated = {"filters": self.filters.bounds(), "passport": self.checks.stated()}
        return self.options.stated() | stated

    def hashes(self) -> dict[str, str]:
        """Return name and SHA-256 of each input except the record files."""
        return {name: sha256_of(path) for name, path in self.files_stated.items()}

    def refuse(self, outputs: Sequence[Path]) -> None:
        """Refuse outputs that would overwrite an input; earlier outputs may be overwritten."""
        strange = [s.path for s in self.sources if s.path.suffix == ".nc" and _is_other(s.path)]
        used = self.files_stated.values()
        read = [*used, *strange, *(s.path for s in self.sources if s.is_read)]
        refuse_overwriting(outputs, read, beside=outputs[0])
        refuse_strange_entries(outputs[1])
        require_ending(outputs[0])

    def readings(
        self,
        progress: Callable[[str], None] | None,
        *,
        workers: int | None,
        limits: Limits | None = None,
        owners: Owners | None = None,
        claims: Claims | None = None,
    ) -> Generator[Reading | InputOutcome, None, None]:
        """Read the files; the parameters are those of `collect_sources`."""
        return collect_sources(
            self.sources,
            read_options(self.options),
            progress,
            workers=workers,
            limits=limits,
            read=partial(
                read_and_measured,
                uncorrected=self.options.uncorrected,
                ratio=self.checks.signal_to_noise_ratio,
            ),
            owners=owners,
            claims=claims,
        )


def _catalogues(sources: Iterable[Source]) -> dict[str, Path]:
    """Return the catalogues in use, by name."""
    return {s.name: s.path for s in sources if (s.note or s.pending) and is_catalogue(s.path)}


def _is_other(path: Path) -> bool:
    """Return True if a file is not one of netCDF-4."""
    if not path.is_file():
        return True
    with path.open("rb") as stream:
        return stream.read(4) != b"\x89HDF"


#: Formats of the files that an option concerns.
_OF_FORMATS: Final = {
    **dict.fromkeys(
        (
            *("column", "skip_lines", "comment", "separator", "decimal", "first_line"),
            *("values_per_line", "time_column", "channels"),
        ),
        ("acceleration_text",),
    ),
    "streams": ("asdf",),
    "station_xml": ("miniseed", "sac"),
    "water_level_db": ("miniseed",),
}


def warn_of_idle_options(
    options: IngestOptions, formats: Sequence[str], rows: Sequence[InputOutcome]
) -> None:
    """Warn of options for which there is no record, if all inputs were accepted.

    Parameters
    ----------
    options : IngestOptions
        The options.
    formats : sequence of str
        Format of the file of each accepted record.
    rows : sequence of InputOutcome
        Outcomes of all inputs.
    """
    if any(row.status not in ("accepted", "rotated") for row in rows):
        return
    for name, concerned in _OF_FORMATS.items():
        if getattr(options, name) not in (None, 0) and {*formats}.isdisjoint(concerned):
            kinds = " or ".join(concerned)
            words = f"{name} has no effect: none of the {len(formats)} records is of {kinds}."
            warnings.warn(words, RockframeWarning, stacklevel=3)
    if options.band_pass_hz is not None and not any(row.corrected_here for row in rows):
        words = "band_pass_hz has no effect: all records count as corrected."
        advice = "State uncorrected to filter them all the same."
        warnings.warn(f"{words} {advice}", RockframeWarning, stacklevel=3)
