"""Arguments of the Python functions are held to the rules of a card: all that are bad at once, before any work."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

import bayesplate
from bayesplate import GradingRequest, Problem
from bayesplate.commands import arguments
from bayesplate.commands.arguments import read_arguments
from bayesplate.errors import InputError

BOARD = "fiemme-spruce-clamped"
LIST = "a list of names of effects"
WHOLE = "a whole number from 0 on"
RANGE = "positive numbers, the least before the greatest, at least one of them"
ONE = ["a.wav"]
BAD = [
    (bayesplate.fit, {"law": "linaer"}, "(did you mean linear?)"),
    (bayesplate.fit, {"effects": "transverse_shear"},
     f'effects: wanted {LIST}, got "transverse_shear" (effects=["transverse_shear"])'),
    (bayesplate.fit, {"effects": [3]}, "effects 1: wanted one of transverse_shear"),
    (bayesplate.fit, {"effects": ["fluid_loading", "fluid_loading"]},
     'effects 2: wanted each name once, got "fluid_loading" again'),
    (bayesplate.fit, {"seed": -1}, f"seed: wanted {WHOLE}, got -1"),
    (bayesplate.fit, {"seed": 1.0}, f"seed: wanted {WHOLE}, got 1.0"),
    (bayesplate.fit, {"seed": 2**63}, "seed: wanted a whole number below 2^63, got 9223372036854775808"),
    # 1 / 50 is a false alarm's two per cent
    (bayesplate.diagnose, {"n_null": 48}, "n_null: wanted a whole number from 49 on, got 48"),
    (bayesplate.fit, {"out": ""}, "out: wanted a name or a path, got an empty text"),
    (bayesplate.fit, {"out": "a\0b"}, "out: wanted a name or a path, got"),
    (bayesplate.fit, {"card": None}, "card: wanted a name, a path, a Board or a Problem, got None"),
    (Problem.from_card, {"prior": 3}, "prior: wanted a name, a path or a PriorCard, got 3"),
    (bayesplate.fit, {"resume": True, "out": None},
     "resume: wanted the folder of the run that is continued, as out, got no out"),
    (bayesplate.fit, {"robust": 1}, "robust: wanted True or False, got 1"),
    (bayesplate.fit, {"force": True, "resume": True, "out": "x"}, "force and resume: wanted one of them, got both"),
    (bayesplate.plan, {"goal": "E_z"}, "(did you mean E_y?)"),
    (bayesplate.plan, {"costs": {"reading": -1.0}}, "costs reading: wanted a positive number of minutes"),
    (bayesplate.check, {"card": "spruce-half-tops", "setup": "setup.toml"},
     "setup: wanted a board, whose setup it completes, got a campaign"),
    (bayesplate.plan, {"card": "spruce-half-tops", "goal": "explanations"}, "plan one of its boards"),
    (bayesplate.plan, {"card": "spruce-half-tops", "between": ["fluid_loading"]},
     "between: wanted the frequencies of a board, by which effects are told apart, got a campaign"),
    (bayesplate.pick, {"files": "a.wav"}, "files: wanted a list of one path or more"),
    (bayesplate.pick, {"files": ONE, "rate": 0.0, "lowest": 600.0}, "rate: wanted ",
     "lowest and highest: wanted two freq"),
    (bayesplate.pick, {"files": ONE, "hammer": [(1.0, 2.0)] * 2},
     "hammer: wanted no place, one for all files, or one for"),
    (bayesplate.pick, {"files": ONE, "sensor": [(1.0,)]}, "sensor 1: wanted a place (x, y) in m"),
    (bayesplate.pick, {"files": ONE, "sensor_mass": 3.0}, "sensor_mass: wanted mass and standard deviation in kg"),
    (bayesplate.pick, {"files": ONE, "motion": "loud", "polarity": "up"}, 'motion: wanted "acceleration"',
     "polarity: wanted"),
    (bayesplate.pick, {"files": ONE, "channels": "0"}, 'channels: wanted "force,response", "response,force"'),
    (bayesplate.pick, {"files": ONE, "sand": {-1.0: 3}}, "sand -1.0: wanted a frequency in Hz",
     "sand -1.0: wanted a name"),
    (bayesplate.new, {"sizes": {"length_x_mm": 300, "length": 1}},
     "sizes length_x_mm: wanted one of length_x, length_y, thickness, mass, got", "did you mean length_x?",
     "sizes length: wanted one of"),
    (bayesplate.new, {"sizes": {"mass": None, "thickness": [1]}}, "mass: wanted a number, got nothing",
     "thickness: wanted a n"),
    (bayesplate.new, {"sizes": [1], "edges": None}, "edges: wanted a text, got None",
     "sizes: wanted a dict of numbers, got [1]"),
    (bayesplate.fit, {"law": np.array(["linear", "x"])}, 'law: wanted "linear", "exact" or None, got ndarray'),
    (bayesplate.batch, {"workers": 0, "table": "xls"}, "workers: wanted", "table: wanted"),
    (bayesplate.batch, {"grading": 3}, "a GradingRequest or None"),
    *((bayesplate.batch, {"grading": request}, said) for request, said in (
        (GradingRequest(match_percent=3), "dicts by the name of a figure, got int and dict"),
        (GradingRequest(match_percent={"E_z": 1.0}), "grading match_percent: wanted names of E_x, E_y, G_xy, density"),
        (GradingRequest(match_percent={"E_x": -1.0}), "grading match_percent E_x: wanted a positive number"),
        (GradingRequest(limits={"E_x": (None, None)}), f"grading limits E_x: wanted {RANGE}, got (None, None)"),
        (GradingRequest(limits={"E_x": 3.0}), "grading limits E_x: wanted a pair"),
        (GradingRequest(limits={"speed": (1.0, 2.0)}), "grading limits: wanted names of E_x"),
        (GradingRequest(rigidity=float("nan")), "grading rigidity: wanted a positive number of N m"),
    )),
]  # fmt: skip
"""A function, its arguments besides the first, and passages of what is said."""
FIRST = {bayesplate.pick: {}, bayesplate.new: {"path": "mine"}, bayesplate.batch: {"source": "boards", "out": "out"}}
GOOD = [
    (bayesplate.fit, {"law": "linear", "seed": 3, "effects": [], "out": Path("x"), "progress": print}),
    (bayesplate.fit, {"resume": True, "out": "results/x"}),
    (bayesplate.compare, {"coefficients": "published", "force": True}),
    (bayesplate.plan, {"goal": "constants", "costs": {"board": 45}, "between": ["fluid_loading"]}),
]
FUNCTIONS = {
    bayesplate.fit: "seed law robust effects report force resume out progress",
    bayesplate.diagnose: "seed effects report force resume out n_null progress",
    bayesplate.compare: "seed effects coefficients out force progress",
    bayesplate.modes: "seed effects force out",
    bayesplate.plan: "goal costs between seed effects force out progress",
    bayesplate.check: "effects",
    bayesplate.cite: "effects",
}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_what_cannot_be_used_is_refused_and_nothing_written():
    for function, given, *said in BAD:
        with pytest.raises(InputError) as refused:
            function(**FIRST.get(function, {"card": BOARD}) | given)
        faults = [str(fault) for fault in refused.value.faults]
        assert [passage for passage in said if passage not in str(refused.value)] == [], faults
        assert [fault for fault in faults if not any(passage in fault for passage in said)] == []
        assert len(faults) <= len(said)
        assert list(Path().iterdir()) == []


def test_every_function_names_all_its_bad_arguments_at_once():
    for function, names in FUNCTIONS.items():
        bad = dict.fromkeys(names.split(), 2.5)
        with pytest.raises(InputError, match="effects") as caught:
            function(7, **bad)

        assert {fault.place for fault in caught.value.faults} == {"card", *bad}, function
        assert list(Path().iterdir()) == []


def test_what_can_be_used_is_taken_as_it_is():
    for function, given in GOOD:
        assert read_arguments(function, given) == given


def test_other_words_and_numbers_are_read_as_what_they_mean():
    read = read_arguments(bayesplate.fit, {"effects": ("air_loading",), "seed": np.int64(3)})

    assert read == {"effects": ["fluid_loading"], "seed": 3}
    assert type(read["seed"]) is int


def test_a_call_that_python_refuses_is_refused_as_python_does():
    with pytest.raises(TypeError, match="unexpected keyword argument 'sed'"):
        bayesplate.fit(BOARD, sed=3)
    with pytest.raises(TypeError, match="missing a required argument: 'card'"):
        bayesplate.fit(seed=-1)


def blas_threads():
    return {one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"}


def test_no_call_leaves_linear_algebra_to_several_threads(monkeypatch):
    """Several threads for thousands of small matrices only wait for one another: a diagnosis was twice as slow."""
    assert scipy.linalg
    seen = []

    def looked(*_):
        seen.append(blas_threads())
        raise KeyError

    monkeypatch.setattr(arguments, "read_arguments", looked)
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        with pytest.raises(KeyError):
            bayesplate.fit(BOARD)
        assert blas_threads() == before != {1}
    assert seen == [{1}]
