"""Diagnoses made by hand, one of each verdict, with the keys that diagnosis.json promises and no others."""

from __future__ import annotations

from typing import Any

BEFORE = {
    "in_sample_rms_cents": 21.25,
    "leave_one_out_rms_cents": 46.5,
    "nested_leave_one_out_rms_cents": 46.5,
    "log_score": -24.75,
    "hits_90": 0.5,
}
AFTER = {
    "in_sample_rms_cents": 4.25,
    "leave_one_out_rms_cents": 9.5,
    "nested_leave_one_out_rms_cents": 12.5,
    "log_score": -15.5,
    "hits_90": 1.0,
}
SHIFT = {
    "E_x": {"before": 10.25e9, "after": 11.5e9, "shift_in_sd": 2.5},
    "E_y": {"before": 1.0e9, "after": 0.75e9, "shift_in_sd": -1.25},
    "G_xy": {"before": 0.5e9, "after": 0.5e9, "shift_in_sd": 0.0},
}
NEXT = "Weigh a second accelerometer onto the board and measure (1,0) again."


def candidate(name: str, setup: str = "clamped", **changed: Any) -> dict[str, Any]:
    """One candidate as diagnosis.json has it."""
    return {
        "name": name,
        "setup": setup,
        "raw_rms_cents": 45.0,
        "visible_rms_cents": 12.5,
        "bias_percent": {"E_x": 1.5, "E_y": -2.5, "G_xy": 0.5},
        "inclusion_probability": 0.25,
        "amplitude": {"q05": 10.0, "q50": 120.0, "q95": 230.0, "unit": "N/m"},
        "look_alikes": [],
        "rejected_because": None,
    } | changed


TENSION = candidate("membrane_tension", inclusion_probability=0.97)
AIR = candidate(
    "air_loading", raw_rms_cents=60.0, visible_rms_cents=2.5, inclusion_probability=0.02, amplitude=None,
    look_alikes=["attached_mass"], rejected_because="its visible part drowns in the noise",
)  # fmt: skip
GRAIN = candidate("grain_angle", "board", visible_rms_cents=0.25, inclusion_probability=0.01)


def diagnosis(verdict: str, effects: tuple[str, ...] = (), claim: bool = False, after: Any = None) -> dict[str, Any]:
    """A diagnosis with three candidates."""
    still = {name: {**one, "after": one["before"], "shift_in_sd": 0.0} for name, one in SHIFT.items()}
    return {
        "format": 1,
        "verdict": verdict,
        "claim": claim,
        "effects": list(effects),
        "before": BEFORE,
        "after": BEFORE if after is None else after,
        "gain_null_percentile": 99.0 if after else 40.0,
        "elastic_shift": SHIFT if after else still,
        "candidates": [TENSION, AIR, GRAIN],
        "recommendation": NEXT,
    }


DIAGNOSES = {
    "none needed": diagnosis("none needed"),
    "named": diagnosis("named", ("membrane_tension",), claim=True, after=AFTER),
    "indistinguishable group": diagnosis("indistinguishable group", ("membrane_tension", "air_loading"), after=AFTER),
    "unexplained": diagnosis("unexplained"),
    "undetectable": diagnosis("undetectable") | {"candidates": []},
}
"""By verdict."""
