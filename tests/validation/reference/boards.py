"""Fits, diagnoses and plans of shipped cards by the public functions, boiled down from the files that they write."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import bayesplate
from bayesplate.errors import BayesplateError

_MODELS = Path(bayesplate.__file__).resolve().parents[1] / "models"
LONG = ("spruce-half-tops-all", "spruce-half-tops-search")
"""Campaigns whose search takes far more than ten minutes."""
PLANNED = ("fiemme-spruce-clamped", "finnish-spruce-cantilever", "spruce-free-2R", "steel-air-water")
N_PROPOSALS = 3
_ERRORS = (
    "in_sample_rms_cents",
    "leave_one_out_rms_cents",
    "nested_leave_one_out_rms_cents",
    "left_out_boards_rms_cents",
)

Json = dict[str, Any]


def names_of(shelf: str) -> list[str]:
    """Names of the shipped cards of a shelf, "boards" or "campaigns"."""
    return sorted(path.stem for path in (_MODELS / shelf).glob("*.toml"))


def board(name: str) -> Json:
    """Fit and diagnosis of a board."""
    return {"fit": _run(bayesplate.fit, name, _fitted), "diagnose": _run(bayesplate.diagnose, name, _diagnosed)}


def campaign(name: str) -> Json:
    """Diagnosis of a campaign, which holds its fit."""
    return {"diagnose": _run(bayesplate.diagnose, name, _campaign_diagnosed)}


def plan(name: str) -> Json:
    """What to measure next on a board."""
    return {"plan": _run(bayesplate.plan, name, _planned)}


def _run(command: Callable[..., object], name: str, digest: Callable[[Path], Json]) -> Json:
    """What a command wrote on a card, and the processor time that it took, children included."""
    with tempfile.TemporaryDirectory() as folder:
        out, begun = Path(folder) / name, sum(os.times()[:4])
        options = {} if command is bayesplate.plan else {"report": False}
        try:
            command(name, out=out, **options)
        except BayesplateError as error:
            return {"refused": type(error).__name__, "cpu_s": sum(os.times()[:4]) - begun}
        return {**digest(out), "cpu_s": sum(os.times()[:4]) - begun}


def _read(path: Path) -> Json:
    found: Json = json.loads(path.read_text())
    return found


def _spread(one: Mapping[str, Any], effective: float | None) -> Json:
    """Mean, sd and the number of independent draws that they stand on."""
    return {"mean": one["mean"], "sd": one["sd"], "draws": effective}


def _fitted(out: Path) -> Json:
    """Constants, sizes and errors of a fit."""
    found = _read(out / "summary.json")
    draws = found["sampler"]["ess_min"]
    constants = found["elastic"] | {f"noise[{setup}]": one for setup, one in found["noise"].items()}
    return {
        "theory": found["model"]["theory"],
        "law": found["model"]["law"],
        "constants": {name: _spread(one, draws) for name, one in constants.items()},
        "sizes": {name: _spread(one, draws) for name, one in _sizes(found["effects"])},
        "errors": _errors(found["error"]),
    }


def _sizes(effects: Mapping[str, Any]) -> Iterator[tuple[str, Json]]:
    """Parameters of effects: "effect.parameter[owner]" and spread."""
    for owner, named in effects.items():
        for effect, parameters in named.items():
            yield from ((f"{effect}.{key}[{owner}]", one) for key, one in parameters.items())


def _errors(found: Mapping[str, Any]) -> Json:
    return {name: found[name] for name in _ERRORS if name in found}


def _diagnosed(out: Path) -> Json:
    """The verdict on a board, its errors before and after, and the model that the diagnosis ends with."""
    found, after = _read(out / "diagnosis.json"), _fitted(out)
    draws = _read(out / "summary.json")["sampler"]["ess_min"]
    return {
        "verdict": found["verdict"],
        "claim": found["claim"],
        "effects": found["effects"],
        "refitted": found["refitted"],
        "probability_of_none": found["probability_of_none"],
        "explanations": {" + ".join(one["effects"]): one["probability"] for one in found["explanations"][:3]},
        "before": _errors(found["before"]),
        "after": _errors(found["after"]),
        "constants": after["constants"],
        "sizes": after["sizes"],
        "averaged": {name: _spread(one, draws) for name, one in found["elastic_averaged"].items() if one},
    }


def _campaign_diagnosed(out: Path) -> Json:
    """The verdict on a campaign, what its boards share, and the constants of each."""
    found, summary = _read(out / "diagnosis.json"), _read(out / "summary.json")
    shared = {name: one["all_boards"] for name, one in summary["shared"].items()}
    draws = (summary["sampler"] or {}).get("ess_min")
    boards = summary["boards"]
    return {
        "verdict": found["verdict"],
        "claim": found["claim"],
        "effects": found["effects"],
        "probability_of_none": found["probability_of_none"],
        "before": _errors(found["before"] or {}),
        "after": _errors(found["after"] or {}),
        "sizes": {name: _spread(one, draws) for name, one in shared.items()},
        "constants": {
            f"{name} {key}": _spread(one, board["sampler"]["ess_min"])
            for name, board in boards.items()
            for key, one in board["elastic"].items()
        },
    }


def _planned(out: Path) -> Json:
    """The first proposals of a plan with their gains."""
    found = _read(out / "plan.json")
    return {
        "basis": found["basis"],
        "entropy_nats": found["entropy"],
        "proposals": [
            {
                "sentence": one["sentence"],
                "constants": one["gain"]["constants"],
                "constants_error": one["gain"]["constants_error"],
                "explanations": one["gain"]["explanations"],
                "explanations_error": one["gain"]["explanations_error"],
            }
            for one in found["proposals"][:N_PROPOSALS]
        ],
    }
