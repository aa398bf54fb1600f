"""SECURITY.md and the lock file: every promise names a test that there is, every version was asked for."""

from __future__ import annotations

import ast
import re
from importlib.metadata import PackageNotFoundError, distribution
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "SECURITY.md").read_text(encoding="utf-8")
LOCK = (ROOT / "requirements.lock").read_text(encoding="utf-8")
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
LINE = re.compile(r"([a-z0-9]+(?:-[a-z0-9]+)*)==([0-9][A-Za-z0-9.!+]*)")


def tool(name: str) -> ModuleType:
    """A script of .ci."""
    spec = spec_from_file_location(name, ROOT / ".ci" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def faults_of(page: str) -> list[str]:
    """What the page names that is not there: files, commands of the Makefile, and promises that no test holds."""
    named = re.findall(r"`([\w./-]+(?:\.(?:py|md|lock)))`", page)
    found = [f"no file {name}" for name in named if not (ROOT / name).exists()]
    found += [f"no target {name}" for name in re.findall(r"make ([a-z]+)", page) if f"\n{name}:" not in MAKEFILE]
    for row in re.findall(r"^\| (?!Promise|---)(.*) \| (.*) \|$", page, re.MULTILINE):
        tests = re.findall(r"`(tests/[\w/]+\.py)`", row[1])
        found += [] if tests else [f"no test of: {row[0][:40]}"]
        found += [f"no test in {one}" for one in tests if (ROOT / one).exists() and not has_tests(ROOT / one)]
    return found


def has_tests(path: Path) -> bool:
    """Whether a file defines tests."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names |= {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
    return any(name.startswith("test_") for name in names)


def test_every_promise_names_a_test_that_there_is():
    assert faults_of(PAGE) == []
    assert PAGE.count("\n| ") > 6
    for heading in ("What it reads and writes", "What it promises", "How to audit", "How to report a weakness"):
        assert f"\n## {heading}\n" in PAGE


def test_what_is_not_there_is_found():
    """The negative control."""
    for text, fault in {
        "`tests/nowhere.py`": "no file tests/nowhere.py",
        "make nothing": "no target nothing",
        "| It is safe. | trust us |": "no test of: It is safe.",
        "| It is safe. | `tests/runs.py` |": "no test in tests/runs.py",
    }.items():
        assert faults_of(text) == [fault]


def lock_faults(lock: str, asked: list[Requirement]) -> list[str]:
    """Lines that are no name and version, what is asked for and not locked, and versions that were not asked for."""
    lines = lock.splitlines()
    found = [f"no name==version: {line}" for line in lines if not LINE.fullmatch(line)]
    versions = {match[1]: match[2] for line in lines if (match := LINE.fullmatch(line))}
    names = [line.partition("==")[0] for line in lines]
    found += ["not in order, or twice"] if names != sorted(set(names)) else []
    for one in asked:
        version = versions.get(canonicalize_name(one.name))
        if version is None:
            found.append(f"not locked: {one.name}")
        elif not one.specifier.contains(version, prereleases=True):
            found.append(f"{one.name} {version} is not {one.specifier}")
    return found


def test_the_lock_has_all_that_is_asked_for_within_its_bounds():
    asked = tool("lock").wanted()

    assert {"numpy", "emcee", "hypothesis", "pyuff", "sphinx", "ruff"} <= {one.name for one in asked}
    assert lock_faults(LOCK, asked) == []


def test_the_lock_has_what_its_packages_need_in_turn():
    """Of those that are installed here in the version that is locked."""
    versions = {match[1]: match[2] for match in map(LINE.fullmatch, LOCK.splitlines()) if match}
    n_looked_at = 0
    for name, version in versions.items():
        try:
            there = distribution(name)
        except PackageNotFoundError:
            continue
        if there.version == version:
            n_looked_at += 1
            needed = map(Requirement, there.requires or ())
            always = [one for one in needed if one.marker is None or one.marker.evaluate({"extra": ""})]
            assert lock_faults(LOCK, always) == [], name

    assert n_looked_at > 0 or distribution("numpy").version != versions["numpy"]


def test_a_bad_line_is_found():
    """The negative control."""
    for line, fault in {
        "numpy @ https://host.example/numpy.whl": "no name==version: numpy @ https://host.example/numpy.whl",
        "--pre": "no name==version: --pre",
        "numpy==2.0 ; python_version < '3.13'": "no name==version: numpy==2.0 ; python_version < '3.13'",
        "../numpy": "no name==version: ../numpy",
        "numpy==1.26.0": "numpy 1.26.0 is not <3,>=2",
        "scipy==1.14": "not locked: numpy",
    }.items():
        assert fault in lock_faults(line + "\n", [Requirement("numpy>=2,<3")])


def test_an_audit_says_what_it_did_not_look_up():
    looked_up = {"name": "a", "version": "1.0", "vulns": []}
    weak = {"name": "b", "version": "2.0", "vulns": [{"id": "W-1", "fix_versions": ["2.1"]}]}
    skipped = {"name": "c", "skip_reason": "not found"}
    told = tool("audit").told
    for found, said, code in (
        ([looked_up], "1 of 1 packages were looked up, 0 have known weaknesses", 0),
        ([looked_up, weak], "b 2.0: W-1, mended in 2.1", 1),
        ([looked_up, skipped], "not looked up: c", 0),
        ([skipped, skipped], "nothing was audited", 0),
    ):
        lines, given = told(found)
        assert said in "\n".join(lines)
        assert given == code, said
