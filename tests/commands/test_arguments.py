"""Arguments of the Python functions are held to the rules of a card: all that are bad at once, before any work."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import bayesplate
from bayesplate.commands.arguments import require_arguments
from bayesplate.errors import InputError

BOARD = "fiemme-spruce-clamped"
LIST = "a list of names of effects"
WHOLE = "a whole number from 0 on"
BAD = [
    ({"law": "quadratic"}, 'law: wanted "linear", "exact" or None, got "quadratic"'),
    ({"law": "linaer"}, "(did you mean linear?)"),
    ({"law": True}, "law: wanted"),
    ({"effects": "transverse_shear"}, f'effects: wanted {LIST}, got "transverse_shear" (effects=["transverse_shear"])'),
    ({"effects": {"fluid_loading"}}, f"effects: wanted {LIST}, got set"),
    ({"effects": ["grain_angel"]}, "(did you mean grain_angle?)"),
    ({"effects": [3]}, "effects 1: wanted one of transverse_shear"),
    ({"effects": ["fluid_loading", "fluid_loading"]}, 'effects 2: wanted each name once, got "fluid_loading" again'),
    ({"seed": None}, f"seed: wanted {WHOLE}, got None"),
    ({"seed": -1}, f"seed: wanted {WHOLE}, got -1"),
    ({"seed": True}, f"seed: wanted {WHOLE}, got True"),
    ({"seed": 1.0}, f"seed: wanted {WHOLE}, got 1.0"),
    ({"n_null": 48}, "n_null: wanted a whole number from 49 on, got 48"),  # 1 / 50 is a false alarm's two per cent
    ({"out": 3}, "out: wanted a name or a path, got 3"),
    ({"out": ""}, "out: wanted a name or a path, got an empty text"),
    ({"out": "a\0b"}, "out: wanted a name or a path, got"),
    ({"card": None}, "card: wanted a name, a path, a Board or a Problem, got None"),
    ({"prior": 3}, "prior: wanted a name, a path or a PriorCard, got 3"),
    ({"resume": True, "out": None}, "resume: wanted the folder of the run that is continued, as out, got no out"),
    ({"robust": 1}, "robust: wanted True or False, got 1"),
    ({"report": "no"}, 'report: wanted True or False, got "no"'),
    ({"force": True, "resume": True}, "force and resume: wanted one of them, got both"),
    ({"coefficients": "trained"}, "(did you mean training?)"),
    ({"progress": "yes"}, "progress: wanted a function or None"),
    ({"goal": "E_z"}, "(did you mean E_y?)"),
    ({"costs": 3}, "costs: wanted minutes by class: reading, clamping, board, got 3"),
    ({"costs": {"reading": -1.0}}, "costs reading: wanted a positive number of minutes"),
    ({"between": ["grain_angel"]}, "(did you mean grain_angle?)"),
]
GOOD = [
    {"law": None, "seed": 0, "effects": None, "out": None, "progress": None, "coefficients": None},
    {"law": "linear", "seed": np.int64(3), "effects": (), "out": Path("x"), "progress": print},
    {"law": "exact", "effects": ["fluid_loading", "grain_angle"], "card": Path("x.toml"), "n_null": 49},
    {"coefficients": "published", "force": True, "resume": False},
    {"resume": True, "out": "results/x"},
    {"goal": "constants", "costs": {"board": 45}, "between": ["fluid_loading"]},
    {"goal": None, "costs": None, "between": None},
]
FUNCTIONS = {
    "fit": (bayesplate.fit, "seed law robust effects report force resume out progress"),
    "diagnose": (bayesplate.diagnose, "seed effects report force resume out n_null progress"),
    "compare": (bayesplate.compare, "seed effects coefficients out force progress"),
    "modes": (bayesplate.modes, "seed effects force out"),
    "plan": (bayesplate.plan, "goal costs between seed effects force out progress"),
    "check": (bayesplate.check, "effects"),
    "cite": (bayesplate.cite, "effects"),
}


@pytest.mark.parametrize(("given", "said"), BAD)
def test_what_cannot_be_used_is_refused(given, said) -> None:
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        require_arguments(**given)
    assert len(caught.value.faults) == 1
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("given", GOOD)
def test_what_can_be_used_is_let_through(given) -> None:
    require_arguments(**given)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_names_all_its_bad_arguments_at_once(name, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    function, arguments = FUNCTIONS[name]
    bad = dict.fromkeys(arguments.split(), 2.5)

    with pytest.raises(InputError, match="effects") as caught:
        partial(function, 7, **bad)()

    assert {fault.place for fault in caught.value.faults} == {"card", *bad}
    assert list(tmp_path.iterdir()) == []
