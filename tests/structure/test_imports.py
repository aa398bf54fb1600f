"""Who imports whom: every file is held to the allowed graph, and the check itself to fabricated bad files."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bayesplate

PACKAGE = Path(bayesplate.__file__).parent

ROAD = (
    "board",
    "plate",
    "effects",
    "frequencies",
    "estimates",
    "posterior",
    "results",
    "grading",
    "diagnosis",
    "campaign",
    "planning",
    "report",
)
"""Each room sees the rooms before it."""
OPEN_TO_ALL = {"arrays", "errors", "files", "locks", "labels", "libraries", "streams"}
ROOMS = {
    **{room: {*ROAD[: i + 1], *OPEN_TO_ALL} for i, room in enumerate(ROAD)},
    "recordings": {"recordings", "plate", *OPEN_TO_ALL},
    "report": {*ROAD, "recordings", *OPEN_TO_ALL},
    "commands": {*ROAD, "recordings", "commands", *OPEN_TO_ALL},
    "cli": {"cli", "asking", "terminal", "commands", "errors", "__init__"},
    "asking": {"asking", "commands", "errors"},
    "terminal": {"terminal", "commands", "errors"},
    "batch": {"batch", "commands", "errors"},
    "__init__": {*ROAD, "recordings", "commands", *OPEN_TO_ALL},
    "__main__": {"cli"},
    **dict.fromkeys(OPEN_TO_ALL, OPEN_TO_ALL),
}

WITHIN = {
    "diagnosis": (
        ("baseline", "forms", "laws", "signatures", "shifts"),
        ("terms", "hypotheses", "search", "draws", "peaks", "joint", "sensitivity", "folds", "null_control", "known"),
        ("sizes", "verdict", "claim", "stated", "readings"),
        ("known_words", "result", "words", "entries", "findings", "tables"),
    )
}  # fmt: skip
"""Steps of a folder: the files of each see those of the same step and of the steps before, and every file is in one."""
NAMES_ALONE = {
    # `system_of` says which theory is to be cited
    "results": {"plate": set(), "frequencies": {"LawName", "PeakLikelihood", "cents", "system_of"}},
}
"""Of some rooms before it a room takes these names and no others: in results nothing is solved."""
DOORS = {
    "emcee": "posterior",
    "skfem": "plate",
    "arviz": "libraries",
    "xarray": "results",
    "pandas": "results",
    "matplotlib": "report",
    "corner": "report",
    "jinja2": "report",
    "PIL": "recordings",
    "soundfile": "recordings",
    "pyuff": "recordings",
}
"""Heavy libraries and the one room that may import each."""
ONLY_WHERE_NEEDED = {*DOORS, "scipy.stats"}
"""Imported inside functions, so that `--help` answers at once."""
WRITERS = {Path("files.py"), Path("locks.py"), Path("grading/storage.py")}
"""Files are written by the first; the others hold theirs open while a run goes on."""
EXECUTES_DATA = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "marshal", "shelve"}
SEEDED_RANDOM = {"Generator", "BitGenerator", "SeedSequence", "default_rng", "MT19937", "PCG64", "Philox", "SFC64"}
SEEDED_RANDOM |= {"RandomState"}  # what emcee draws from


@dataclass(frozen=True)
class Import:
    """One module named by an import, the line, whether it is imported when the file is, and what is taken from it."""

    module: str
    line: int
    is_at_top: bool
    names: tuple[str, ...]


def faults(package: Path) -> list[str]:
    """Everything in a package that the rules forbid: "file:line what"."""
    found = []
    for path in sorted(package.rglob("*.py")):
        inside = path.relative_to(package)
        tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
        complaints = [*_import_faults(tree, inside), *_call_faults(tree, inside), *_caption_faults(tree)]
        found += [f"{inside.as_posix()}:{line} {what}" for line, what in complaints]
    return found


def _import_faults(tree: ast.Module, inside: Path) -> Iterator[tuple[int, str]]:
    room = inside.with_suffix("").parts[0]
    if room not in ROOMS:
        yield 1, f"stands in no known room: {room}"
        return
    inner = "" if inside.name == "__init__.py" else inside.with_suffix("").parts[-1]
    if room in WITHIN and inner and (len(inside.parts) > 2 or _step(inner, WITHIN[room]) < 0):
        yield 1, f"stands in no known part of {room}"
        return
    for item in _imports(tree):
        parts = item.module.split(".")
        if not parts[0]:
            yield item.line, "imports relatively"
        elif parts[0] == "bayesplate":
            target = parts[1] if len(parts) > 1 else "__init__"
            if target not in ROOMS[room]:
                yield item.line, f"{room} imports {target}"
            elif target == room in WITHIN and len(parts) > 2 and _comes_later(parts[2], inner, WITHIN[room]):
                yield item.line, f"{room}.{inner} imports {room}.{parts[2]}".replace(". ", " ")
            for name in sorted(set(item.names) - NAMES_ALONE.get(room, {}).get(target, set(item.names))):
                yield item.line, f"{room} takes {name} from {target}"
        elif parts[0] in EXECUTES_DATA:
            yield item.line, f"imports {parts[0]}"
        elif DOORS.get(parts[0], room) != room:
            yield item.line, f"{room} imports {parts[0]}, which belongs to {DOORS[parts[0]]}"
        if item.is_at_top and any(f"{item.module}.".startswith(f"{heavy}.") for heavy in ONLY_WHERE_NEEDED):
            yield item.line, f"imports {item.module} at the top"


def _comes_later(target: str, inner: str, steps: tuple[tuple[str, ...], ...]) -> bool:
    """Whether a file of a room is of a later step than the one that imports it; the room's own file is of none."""
    return _step(target, steps) > _step(inner, steps)


def _step(inner: str, steps: tuple[tuple[str, ...], ...]) -> int:
    """In which step of a room a file stands; -1: in none."""
    return next((i for i, step in enumerate(steps) if inner in step), -1)


def _imports(tree: ast.Module) -> Iterator[Import]:
    at_top = _run_on_import(tree)
    for node in ast.walk(tree):
        is_at_top = node in at_top
        if isinstance(node, ast.Import):
            yield from (Import(alias.name, node.lineno, is_at_top, (alias.name,)) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            # `from scipy import stats` and `from bayesplate import modes` name a module after the word import
            names_module = module in {"scipy", "bayesplate", *(f"bayesplate.{room}" for room in WITHIN)}
            names = [f"{module}.{alias.name}" if names_module else module for alias in node.names]
            taken = tuple(alias.name for alias in node.names)
            yield from (Import(name, node.lineno, is_at_top, taken) for name in dict.fromkeys(names))
        elif isinstance(node, ast.Call) and _called(node) in {"import_module", "__import__"}:
            named = node.args[0] if node.args else None
            if isinstance(named, ast.Constant) and isinstance(named.value, str):
                yield Import(named.value, node.lineno, is_at_top, (named.value,))


def _run_on_import(tree: ast.Module) -> set[ast.AST]:
    """Nodes that run when the file is imported: outside functions, and not for the type checker alone."""
    nodes: set[ast.AST] = set()
    waiting: list[ast.AST] = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            continue
        if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
            waiting += node.orelse
            continue
        nodes.add(node)
        waiting += ast.iter_child_nodes(node)
    return nodes


def _call_faults(tree: ast.Module, inside: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield from _one_call_faults(node, inside)
        elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in {"np.random", "numpy.random"}:
            if node.attr not in SEEDED_RANDOM:
                yield node.lineno, f"uses the global random state: {node.attr}"
        elif isinstance(node, ast.ImportFrom) and node.module == "numpy.random":
            for alias in node.names:
                if alias.name not in SEEDED_RANDOM:
                    yield node.lineno, f"uses the global random state: {alias.name}"


def _one_call_faults(node: ast.Call, inside: Path) -> Iterator[tuple[int, str]]:
    if isinstance(node.func, ast.Name) and node.func.id in {"eval", "exec"}:
        yield node.lineno, f"calls {node.func.id}"
    allows = [k.value for k in node.keywords if k.arg == "allow_pickle"]
    if any(not (isinstance(value, ast.Constant) and value.value is False) for value in allows):
        yield node.lineno, "allows pickles"
    # the public names of the package are fetched from their homes by name, and the effects by the words of the cards
    is_hidden = _called(node) in {"import_module", "__import__"} and not isinstance(node.args[0], ast.Constant)
    if is_hidden and inside not in (Path("__init__.py"), Path("effects/__init__.py")):
        yield node.lineno, "imports a module of a computed name"

    if _writes_a_file(node) and inside not in WRITERS:
        yield node.lineno, "writes a file by itself: bayesplate.files does"


def _writes_a_file(node: ast.Call) -> bool:
    given = [*node.args, *(one.value for one in node.keywords)]
    modes = [one.value for one in given if isinstance(one, ast.Constant) and isinstance(one.value, str)]
    if _called(node) == "open":
        return any(re.fullmatch("[wax][bt+]*", mode) for mode in modes)
    name = ast.unparse(node.func)
    return name == "os.replace" or name.endswith((".write_text", ".write_bytes"))


def _called(node: ast.Call) -> str:
    return ast.unparse(node.func).rpartition(".")[2]


def _caption_faults(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """An empty file needs no caption; every other opens with one line that says what is in it."""
    if tree.body and not (ast.get_docstring(tree, clean=False) or "").partition("\n")[0].strip():
        yield 1, "has no caption: the first line of its docstring"


def test_package_keeps_the_rules():
    """Every file of it is read: the rules would hold for an empty list of files as well."""
    assert faults(PACKAGE) == []
    read = {path.relative_to(PACKAGE).parts[0] for path in PACKAGE.rglob("*.py")}
    assert {"board", "plate", "frequencies", "errors.py", "labels.py"} <= read


BAD_FILES = [
    ("board/bad.py", "from bayesplate.plate.terms import Weights", "board imports plate"),
    ("board/bad.py", "from bayesplate import plate", "board imports plate"),
    ("board/bad.py", "import bayesplate.plate.plate", "board imports plate"),
    ("board/bad.py", "def f():\n    from bayesplate.effects import declare", "board imports effects"),
    ("plate/bad.py", "import importlib\nimportlib.import_module('bayesplate.report.page')", "plate imports report"),
    ("diagnosis/words.py", "from bayesplate.campaign.shared import Shared", "diagnosis imports campaign"),
    ("campaign/bad.py", "from bayesplate.report.page import policy", "campaign imports report"),
    ("recordings/bad.py", "from bayesplate.board.board import Board", "recordings imports board"),
    ("posterior/bad.py", "from bayesplate.commands.fit import fit", "posterior imports commands"),
    ("plate/bad.py", "def f():\n    from bayesplate.commands.modes import modes", "plate imports commands"),
    ("cli.py", "from bayesplate.plate.terms import Weights", "cli imports plate"),
    ("terminal.py", "from bayesplate.cli import main", "terminal imports cli"),
    ("commands/bad.py", "from bayesplate.terminal import exit_on_error", "commands imports terminal"),
    ("batch.py", "from bayesplate.cli import main", "batch imports cli"),
    ("errors.py", "from bayesplate.board.board import Board", "errors imports board"),
    ("gadgets/bad.py", "", "stands in no known room: gadgets"),
    ("diagnosis/bad.py", "", "stands in no known part of diagnosis"),
    ("diagnosis/gadgets/bad.py", "", "stands in no known part of diagnosis"),
    ("diagnosis/shifts.py", "from bayesplate.diagnosis.search import SearchResult", "shifts imports diagnosis.search"),
    ("diagnosis/terms.py", "from bayesplate.diagnosis import verdict", "terms imports diagnosis.verdict"),
    ("diagnosis/claim.py", "import bayesplate.diagnosis.words", "claim imports diagnosis.words"),
    ("diagnosis/__init__.py", "from bayesplate.diagnosis.laws import form_law", "diagnosis imports diagnosis.laws"),
    ("plate/bad.py", "from . import plate", "imports relatively"),
    ("plate/bad.py", "def f():\n    import emcee", "plate imports emcee, which belongs to posterior"),
    ("posterior/bad.py", "import emcee", "imports emcee at the top"),
    ("plate/bad.py", "class A:\n    import skfem.helpers", "imports skfem.helpers at the top"),
    ("report/bad.py", "if True:\n    from matplotlib import pyplot", "imports matplotlib at the top"),
    ("report/bad.py", "def f():\n    from xarray import Dataset", "report imports xarray, which belongs to results"),
    ("planning/bad.py", "from scipy import stats", "imports scipy.stats at the top"),
    ("planning/bad.py", "from scipy.stats import norm", "imports scipy.stats at the top"),
    ("results/bad.py", "def f():\n    import pickle", "imports pickle"),
    ("results/bad.py", "from bayesplate.frequencies.spectrum import cents, spectra", "takes spectra from frequencies"),
    ("results/bad.py", "from bayesplate.plate.terms import Weights", "results takes Weights from plate"),
    ("results/bad.py", "import bayesplate.plate.solve", "results takes bayesplate.plate.solve from plate"),
    ("results/bad.py", "import numpy as np\nnp.load('x', allow_pickle=True)", "allows pickles"),
    *(
        ("board/bad.py", f"import os, pathlib\n{call}", "writes a file by itself: bayesplate.files does")
        for call in (
            "pathlib.Path('x').write_text('')",
            "pathlib.Path('x').write_bytes(b'')",
            "pathlib.Path('x').open('wb')",
            "open('x', mode='a')",
            "os.replace('x', 'y')",
        )
    ),
    ("board/bad.py", "x = eval('1')", "calls eval"),
    ("board/bad.py", "exec('x = 1')", "calls exec"),
    ("plate/bad.py", "import numpy as np\nnp.random.seed(1)", "uses the global random state: seed"),
    ("plate/bad.py", "from numpy.random import normal", "uses the global random state: normal"),
    ("plate/bad.py", "import importlib\nimportlib.import_module('em' + 'cee')", "imports a module of a computed name"),
]


def test_each_rule_catches_a_file_that_breaks_it_and_names_only_that_fault(tmp_path):
    """The negative control."""
    for number, (place, code, fault) in enumerate(BAD_FILES):
        package = tmp_path / str(number)
        path = package / place
        path.parent.mkdir(parents=True)
        path.write_text(f'"""A caption."""\n\n{code}\n')
        found = faults(package)
        assert [one.startswith(f"{place}:") and one.endswith(fault) for one in found] == [True], (place, fault, found)
    for text in ("x = 1\n", '"""\n\nToo late."""\nx = 1\n', "# a comment is no caption\nx = 1\n"):
        (tmp_path / "labels.py").write_text(text)
        assert "labels.py:1 has no caption: the first line of its docstring" in faults(tmp_path), text


def test_good_file_is_let_through(tmp_path):
    """What the rules allow: earlier rooms, a library behind its door in a function, names for the type checker."""
    (tmp_path / "posterior").mkdir()
    (tmp_path / "posterior" / "__init__.py").write_text("")
    (tmp_path / "posterior" / "good.py").write_text(
        '"""A caption."""\n'
        "from typing import TYPE_CHECKING\n"
        "import numpy as np\n"
        "from bayesplate.errors import InputError\n"
        "from bayesplate.frequencies.laws import Law\n"
        "from scipy import special\n"
        "if TYPE_CHECKING:\n"
        "    from emcee import State\n"
        "def draw(rng: np.random.Generator):\n"
        "    import emcee\n"
        "    from scipy.stats import norm\n"
        "    return np.load('x', allow_pickle=False), np.random.default_rng(1)\n"
    )

    assert faults(tmp_path) == []
