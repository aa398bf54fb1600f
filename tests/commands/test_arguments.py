"""Arguments of the Python functions are held to the rules of a card: all that are bad at once, before any work."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import bayesplate
from bayesplate.commands.arguments import read_arguments
from bayesplate.errors import InputError

BOARD = "fiemme-spruce-clamped"
LIST = "a list of names of effects"
WHOLE = "a whole number from 0 on"
BAD = [
    ({"law": "linaer"}, "(did you mean linear?)"),
    ({"effects": "transverse_shear"}, f'effects: wanted {LIST}, got "transverse_shear" (effects=["transverse_shear"])'),
    ({"effects": [3]}, "effects 1: wanted one of transverse_shear"),
    ({"effects": ["fluid_loading", "fluid_loading"]}, 'effects 2: wanted each name once, got "fluid_loading" again'),
    ({"seed": -1}, f"seed: wanted {WHOLE}, got -1"),
    ({"seed": 1.0}, f"seed: wanted {WHOLE}, got 1.0"),
    ({"n_null": 48}, "n_null: wanted a whole number from 49 on, got 48"),  # 1 / 50 is a false alarm's two per cent
    ({"out": ""}, "out: wanted a name or a path, got an empty text"),
    ({"out": "a\0b"}, "out: wanted a name or a path, got"),
    ({"card": None}, "card: wanted a name, a path, a Board or a Problem, got None"),
    ({"prior": 3}, "prior: wanted a name, a path or a PriorCard, got 3"),
    ({"resume": True, "out": None}, "resume: wanted the folder of the run that is continued, as out, got no out"),
    ({"robust": 1}, "robust: wanted True or False, got 1"),
    ({"force": True, "resume": True, "out": "x"}, "force and resume: wanted one of them, got both"),
    ({"goal": "E_z"}, "(did you mean E_y?)"),
    ({"costs": {"reading": -1.0}}, "costs reading: wanted a positive number of minutes"),
]
GOOD = [
    (bayesplate.fit, {"law": "linear", "seed": 3, "effects": [], "out": Path("x"), "progress": print}),
    (bayesplate.fit, {"resume": True, "out": "results/x"}),
    (bayesplate.compare, {"coefficients": "published", "force": True}),
    (bayesplate.plan, {"goal": "constants", "costs": {"board": 45}, "between": ["fluid_loading"]}),
]
TAKEN_BY = {
    "n_null": bayesplate.diagnose,
    "prior": bayesplate.Problem.from_card,
    **dict.fromkeys(("goal", "costs"), bayesplate.plan),
    **dict.fromkeys(("law", "effects", "seed", "out", "card", "resume", "robust"), bayesplate.fit),
}
FUNCTIONS = {
    "fit": (bayesplate.fit, "seed law robust effects report force resume out progress"),
    "diagnose": (bayesplate.diagnose, "seed effects report force resume out n_null progress"),
    "compare": (bayesplate.compare, "seed effects coefficients out force progress"),
    "modes": (bayesplate.modes, "seed effects force out"),
    "plan": (bayesplate.plan, "goal costs between seed effects force out progress"),
    "check": (bayesplate.check, "effects"),
    "cite": (bayesplate.cite, "effects"),
}


def test_what_cannot_be_used_is_refused():
    for given, said in BAD:
        function = next(one for name, one in TAKEN_BY.items() if name in given)
        with pytest.raises(InputError, match=re.escape(said)) as caught:
            function(**{"card": BOARD, **given})
        assert len(caught.value.faults) == 1
        assert caught.value.exit_code == 3


def test_what_can_be_used_is_let_through():
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


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_names_all_its_bad_arguments_at_once(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function, arguments = FUNCTIONS[name]
    bad = dict.fromkeys(arguments.split(), 2.5)

    with pytest.raises(InputError, match="effects") as caught:
        partial(function, 7, **bad)()

    assert {fault.place for fault in caught.value.faults} == {"card", *bad}
    assert list(tmp_path.iterdir()) == []
