"""The public names are those that can be imported, and importing them costs nothing until they are used."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import bayesplate

HEAVY = {"numpy", "scipy", "emcee", "arviz", "xarray", "matplotlib", "corner", "skfem", "pydantic", "h5py", "h5netcdf"}


def roots_after(program: str) -> set[str]:
    """Roots of the modules that a fresh interpreter holds after a program."""
    tail = "\nimport sys\nprint(' '.join(sorted({name.partition('.')[0] for name in sys.modules})))"
    done = subprocess.run([sys.executable, "-c", program + tail], check=True, capture_output=True, text=True)
    return set(done.stdout.splitlines()[-1].split())


def test_the_public_names_are_those_that_can_be_imported():
    """Listed, at home where the list says, and known to a type checker: two lists that must be one."""
    tree = ast.parse(Path(bayesplate.__file__).read_text(encoding="utf-8"))
    (for_types,) = (node for node in tree.body if isinstance(node, ast.If))
    typed = {alias.name for line in for_types.body if isinstance(line, ast.ImportFrom) for alias in line.names}
    namespace: dict[str, object] = {}
    exec("from bayesplate import *", namespace)

    assert bayesplate.__all__ == sorted(bayesplate.__all__)
    assert typed == set(bayesplate.__all__) == set(namespace) - {"__builtins__"}
    for name in bayesplate.__all__:
        item = getattr(bayesplate, name)
        assert item is namespace[name]
        assert item.__doc__
        if name != "modes":
            assert (item.__name__, item.__module__) == (name, bayesplate._HOMES[name])


def test_a_name_that_is_not_public_is_refused():
    with pytest.raises(AttributeError, match="module 'bayesplate' has no attribute 'fitt'"):
        _ = bayesplate.fitt


def test_importing_the_package_imports_no_other():
    plain, loaded = roots_after(""), roots_after("import bayesplate")

    assert loaded - plain - set(sys.stdlib_module_names) == {"bayesplate"}


HELP = """
from bayesplate.cli import main
for arguments in {lines}:
    try:
        main(arguments)
    except SystemExit as end:
        assert not end.code
"""


def test_help_imports_nothing_heavy():
    loaded = roots_after(HELP.format(lines=[["--help"], ["--version"]]))

    assert "click" in loaded
    assert loaded & HEAVY == set()


def test_help_of_a_command_imports_what_its_function_does_and_nothing_to_sample_or_draw():
    loaded = roots_after(HELP.format(lines=[["fit", "--help"], ["check", "--help"]]))

    assert loaded & HEAVY == {"numpy", "scipy", "pydantic"}


def test_checking_imports_no_sampler():
    loaded = roots_after("import bayesplate; bayesplate.check('acrylic-panel')")

    assert loaded & {"numpy", "emcee", "arviz", "xarray", "matplotlib"} == {"numpy"}
