"""`python tests/fuzz/target.py NAME CORPUS [libFuzzer flags]`: feed one reader until it fails.

Only a RockframeError may escape. NAME is a format, `containers` (archives), or `any` (the file as
`rockframe ingest` takes it: archives, sniffing, reading).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path


def target(name: str) -> Callable[[bytes], None]:
    """Return the function to feed. It imports the readers, so that they are instrumented."""
    from rockframe.errors import RockframeError
    from rockframe.ingest import FORMATS, ReadOptions, read_bytes
    from rockframe.ingest.containers import contents
    from rockframe.ingest.files import read_content

    formats = {known.name: known for known in FORMATS}
    stated = (ReadOptions(), ReadOptions(units="g", time_step=0.01))

    def feed(data: bytes) -> None:
        path, options = Path("fuzz"), stated[len(data) % 2]
        try:
            if name in formats:
                formats[name].sniff(data[:4096])
                read_bytes(path, data, options, formats[name])
            else:
                for content in contents(path, data):
                    if name == "any":
                        read_content(content, options)
        except RockframeError as error:
            if "\n" in str(error):
                raise ValueError("an error of several lines") from error

    return feed


def main() -> None:
    """Fuzz until the time ends or there is a finding."""
    import atheris

    with atheris.instrument_imports(include=["rockframe"]):
        feed = target(sys.argv[1])
    atheris.Setup([sys.argv[0], *sys.argv[2:]], feed)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
