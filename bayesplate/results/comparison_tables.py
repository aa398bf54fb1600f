"""The tables of `compare` and `modes`: text cells only, no layout."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesplate.results.tables import Table, decimals

_GPA = 1e9
_METHODS = {
    "paper_least_squares": "paper",
    "weighted_least_squares": "weighted",
    "percentile": "percentile",
    "linear_posterior": "linear",
    "exact_posterior": "exact",
}
METHODS_REMARK = (
    "paper: its unweighted least squares; weighted: least squares of relative errors, ± what noise, misfit and "
    "uncertain inputs let expect; percentile: ± how far trimmed estimates from subsets of the modes lie apart, which "
    "is no error; linear, exact: posterior under that law, ± its standard deviation"
)
_DEFAULT_DIGITS = 3


def methods_table(name: str, theory: Mapping[str, Any]) -> Table:
    """The constants of every method under one theory of the plate, and how far each misses the readings."""
    rows = []
    for method in theory["methods"]:
        words = _METHODS[method["name"]]
        if "n_subsets" in method:
            words += f" ({method['n_subsets']})"
        miss = method["forward_rms_cents"]
        cells = (_constant(method["elastic"][modulus]) for modulus in ("E_x", "E_y", "G_xy"))
        rows.append((words, *cells, "-" if miss is None else f"{miss:.1f}"))
    return Table(
        f"{name}, {theory['theory']} plate: GPa, and how far the readings are missed, cents rms",
        ("method", "E_x", "E_y", "G_xy", "misses"),
        tuple(rows),
    )


def forward_table(theory: Mapping[str, Any]) -> Table:
    """The forward check: what the exact law predicts at each method's constants, less the reading, cents."""
    several = len({mode["setup"] for mode in theory["modes"]}) > 1
    rows = [
        (
            f"{mode['label']} {mode['setup']}" if several else mode["label"],
            f"{mode['measured_hz']:.6g}",
            *(_cents(method["forward"][i]["cents"]) for method in theory["methods"]),
            _cents(None if mode["left_out_cents"] is None else -mode["left_out_cents"]),
        )
        for i, mode in enumerate(theory["modes"])
    ]
    return Table(
        f"Forward check, {theory['theory']} plate: predicted less measured, cents",
        ("mode", "Hz", *(_METHODS[method["name"]] for method in theory["methods"]), "left out"),
        tuple(rows),
    )


def sheet_table(name: str, setup: Mapping[str, Any]) -> Table:
    """The lowest modes of a setup: frequency, energies, the paper's coefficients."""
    has_effects = any(mode["share_percent"]["effects"] for mode in setup["modes"])
    rows = tuple(
        (
            mode["label"],
            f"{mode['hz']:.1f}",
            _reading(mode),
            " / ".join(str(share) for share in _shares(mode["share_percent"], has_effects)),
            *(f"{mode[letter]:.4g}" for letter in "abc"),
        )
        for mode in setup["modes"]
    )
    energy = "% in D_x/D_y/D_s" + ("/rest" if has_effects else "")
    is_expected = any(mode["likely_hz"] for mode in setup["modes"])
    return Table(
        f"Lowest modes of {name}, setup {setup['setup']}, {setup['theory']} plate",
        ("mode", "Hz", "likely Hz" if is_expected else "measured Hz", energy, "a", "b", "c"),
        rows,
    )


def _shares(shares: Mapping[str, float], has_effects: bool) -> list[int]:
    names = ("D_x", "D_y", "D_s", "effects") if has_effects else ("D_x", "D_y", "D_s")
    return [round(shares[name]) for name in names]


def _reading(mode: Mapping[str, Any]) -> str:
    if mode["likely_hz"] is not None:
        return f"{mode['likely_hz'][0]:.0f} to {mode['likely_hz'][1]:.0f}"
    return "-" if mode["measured_hz"] is None else f"{mode['measured_hz']:.6g}"


def _constant(entry: Mapping[str, Any]) -> str:
    if entry["mean"] is None:
        return "-"
    mean, sd = entry["mean"] / _GPA, entry.get("sd")
    if not sd:
        return f"{mean:.{_DEFAULT_DIGITS}f}"
    digits = decimals(sd / _GPA)
    return f"{mean:.{digits}f} ± {sd / _GPA:.{digits}f}"


def _cents(value: float | None) -> str:
    return "-" if value is None else f"{value:+.1f}"
