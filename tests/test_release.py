"""A release as an index and a stranger see it: one version, whole links, every licence."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from types import ModuleType

import netCDF4
import pytest
from tests.commands import ingested
from tests.conftest import REPOSITORY

import rockframe
from rockframe.cli.main import main
from rockframe.provenance import package_versions

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))
#: An address that a link may begin with outside the repository.
FULL = re.compile(r"https://|mailto:")


@pytest.fixture(scope="module")
def build() -> ModuleType:
    """Return the module that completes the metadata of the distribution."""
    pytest.importorskip("hatchling", reason="hatchling builds the distribution")
    place = importlib.util.spec_from_file_location("hatch_build", REPOSITORY / "hatch_build.py")
    assert place is not None
    assert place.loader is not None
    module = importlib.util.module_from_spec(place)
    place.loader.exec_module(module)
    return module


def text_of(name: str) -> str:
    return (REPOSITORY / name).read_text(encoding="utf-8")


def test_one_version_stands_in_all_places(capsys: pytest.CaptureFixture[str]) -> None:
    """The package states it; the wheel reads it from there, and people from two other files."""
    version = rockframe.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", version)
    assert "version" in PROJECT["project"]["dynamic"]
    assert f"\nversion: {version}\n" in text_of("CITATION.cff")
    newest = re.search(r"^## (\S+)", text_of("CHANGELOG.md"), re.MULTILINE)
    assert newest is not None
    assert newest[1] == version
    assert package_versions()["rockframe"] == version
    with pytest.raises(SystemExit, match="0"):
        main(["--version"])
    assert capsys.readouterr().out == f"rockframe {version}\n"


def test_no_relative_link_is_left_in_the_long_description(build: ModuleType) -> None:
    shown = build.long_description(text_of("README.md"), "somebody", "1.2.3")
    links = re.findall(r"\]\(([^)]*)\)|(?:src|href)=[\"']([^\"']*)", shown)
    targets = [first or second for first, second in links]
    assert len(targets) >= 5
    assert [target for target in targets if not FULL.match(target)] == []
    assert "<!--" not in shown
    assert [path for path in linked_files(targets) if not (REPOSITORY / path).is_file()] == []


def linked_files(targets: list[str]) -> list[str]:
    """Return the paths in the repository to which links at the tag of the version lead."""
    at_tag = r"https://github\.com/somebody/rockframe/(?:raw|blob)/v1\.2\.3/([^#]+)"
    return [match[1] for match in (re.match(at_tag, target) for target in targets) if match]


def test_links_lead_to_the_tag_and_pictures_to_their_bytes(build: ModuleType) -> None:
    readme = "![a](docs/a.png) [b](docs/b.md#c) [d](#e) [f](https://g.org) <!-- not run: h -->\n"
    at_tag = "https://github.com/me/rockframe"
    assert build.long_description(readme, "me", "1.0.0").split(" ") == [
        f"![a]({at_tag}/raw/v1.0.0/docs/a.png)",
        f"[b]({at_tag}/blob/v1.0.0/docs/b.md#c)",
        f"[d]({at_tag}/blob/v1.0.0/README.md#e)",
        "[f](https://g.org)",
        "",
    ]


def test_all_addresses_follow_from_one_owner(build: ModuleType) -> None:
    owner = PROJECT["tool"]["hatch"]["metadata"]["hooks"]["custom"]["owner"]
    links = build.links(owner)
    assert {"Documentation", "Source", "Changelog", "Issues"} == {*links}
    assert f'repository-code: "{links["Source"]}"' in text_of("CITATION.cff")
    assert all(owner.lower() in link.lower() for link in links.values())
    assert all("other" in link for link in build.links("other").values())


def test_the_licence_of_everything_that_the_wheel_contains_is_declared() -> None:
    files = PROJECT["project"]["license-files"]
    assert all((REPOSITORY / name).is_file() for name in files)
    assert {"LICENSE", "records/README.md"} < {*files}
    vendored = (REPOSITORY / "pipeline").rglob("*LICENSE*")
    assert {path.relative_to(REPOSITORY).as_posix() for path in vendored} <= {*files}


def test_the_terms_of_the_records_are_whole_and_go_with_the_wheel() -> None:
    """CC0 has a purpose, a waiver, and a licence where the waiver is not valid: not only a link."""
    assert "CC0-1.0" in PROJECT["project"]["license"]
    assert "records/CC0-1.0.txt" in PROJECT["project"]["license-files"]
    terms = text_of("records/CC0-1.0.txt")
    assert "CC0 1.0 Universal" in terms
    for part in ("1. Copyright and Related Rights", "2. Waiver", "3. Public License Fallback"):
        assert part in terms


def test_the_sdist_has_the_pages_that_its_tests_and_its_metadata_read() -> None:
    """The metadata are those of README.md, so without it nobody can build a wheel of the sdist."""
    sdist = pytest.importorskip("hatchling.builders.sdist", reason="hatchling builds the sdist")
    files = sdist.SdistBuilder(str(REPOSITORY)).recurse_included_files()
    paths = {Path(file.distribution_path).as_posix() for file in files}
    named = re.findall(r'text_of\("([^"]+)"\)', text_of("tests/test_release.py"))
    assert {*named, "README.md"} - paths == set()
    assert "pipeline/rockframe/__init__.py" in paths


def test_classifiers_name_the_versions_that_are_tested() -> None:
    tested = re.search(r"python: \[([^\]]*)\]", text_of(".github/workflows/tests.yml"))
    assert tested is not None
    for version in re.findall(r"3\.\d+", tested[1]):
        assert f"Programming Language :: Python :: {version}" in PROJECT["project"]["classifiers"]
    assert PROJECT["project"]["requires-python"] == ">=3.11"


def test_an_installed_package_states_where_its_documentation_is() -> None:
    try:
        urls = metadata("rockframe").get_all("Project-URL") or []
    except PackageNotFoundError:
        pytest.skip("the package is not installed here")
    if not urls:
        pytest.skip("installed before the package had links: make setup")
    assert any(url.startswith("Documentation, https://") for url in urls)


def test_workflows_name_the_commit_of_each_action() -> None:
    """A tag can be moved to other code; a commit cannot."""
    folder: Path = REPOSITORY / ".github" / "workflows"
    used = [
        line
        for path in folder.glob("*.yml")
        for line in re.findall(r"uses: (\S+)", path.read_text("utf-8"))
    ]
    assert used
    assert [one for one in used if not re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", one)] == []


def test_every_reference_of_the_paper_is_in_its_bibliography_and_used() -> None:
    cited = set(re.findall(r"@(\w+)", text_of("paper.md").split("---", 2)[2]))
    listed = re.findall(r"^@\w+\{(\w+),", text_of("paper.bib"), re.MULTILINE)
    assert len(listed) == len({*listed}) > 5
    assert cited == {*listed}


def test_a_file_of_a_later_version_opens_without_what_is_not_known_here(motion: Path) -> None:
    records = ingested(motion)
    with netCDF4.Dataset(records, "a") as file:
        file.createVariable("quantity_of_a_later_version", "f8", ("record",))
    with rockframe.open_records(records) as opened:
        assert len(list(opened)) == 1


#: Words in commands of pages that only a clone has, and pages that say so or take other files.
OF_CLONE = ("records/ridgecrest2019", "workflows/", "make ", "tests.")
NEED_MORE = {"archive", "compare", "findings", "formats-of-others", "select", "validation"}


def test_commands_of_the_pages_run_without_a_clone() -> None:
    """A stranger has the installed package alone, and types what the pages show."""
    for page in sorted((REPOSITORY / "docs").rglob("*.md")):
        if page.stem not in NEED_MORE and "generated" not in page.parts:
            shown = re.sub(r"<!-- before:.*?-->", "", page.read_text("utf-8"), flags=re.DOTALL)
            for commands in re.findall(r"^```(?:sh|python)\n(.*?)^```", shown, re.DOTALL | re.M):
                assert [word for word in OF_CLONE if word in commands] == [], f"{page}: {commands}"
