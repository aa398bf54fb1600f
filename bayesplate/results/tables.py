"""The tables that people read: constants with plus-minus, modes in cents; text cells only, no layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

_GPA = 1e9
_WORDS = {
    "E_x": "along grain",
    "E_y": "across grain",
    "G_xy": "shear",
}


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes
    ----------
    title : str
    columns : tuple of str
    rows : tuple of tuple of str
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def constants_table(summary: Mapping[str, Any]) -> Table:
    """The elastic constants of a fit: mean, plus-minus, 90 % interval, beside the least-squares figure."""
    rows = []
    for name, words in _WORDS.items():
        entry = summary["elastic"][name]
        mean, sd, low, high = (entry[key] / _GPA for key in ("mean", "sd", "q05", "q95"))
        digits = decimals(sd)
        rows.append(
            (
                f"{name}, {words}",
                f"{mean:.{digits}f} ± {sd:.{digits}f}",
                f"{low:.{digits}f} to {high:.{digits}f}",
                f"{100 * sd / mean:.1f}",
                f"{summary['weighted_least_squares'][name] / _GPA:.{digits}f}",
            )
        )
    return Table(
        f"Elastic constants of {summary['name']}, GPa",
        ("constant", "mean ± sd", "90 % interval", "sd, %", "least squares"),
        tuple(rows),
    )


def modes_table(summary: Mapping[str, Any]) -> Table:
    """Each labelled mode: measured, predicted, and how far the best fit misses it, with and without having seen it."""
    several = len({mode["setup"] for mode in summary["modes"]}) > 1
    rows = [
        (
            f"{mode['label']} {mode['setup']}" if several else mode["label"],
            f"{mode['measured_hz']:.6g}",
            f"{mode['predicted_hz']['mean']:.1f}",
            f"{mode['predicted_hz']['q05']:.1f} to {mode['predicted_hz']['q95']:.1f}",
            f"{mode['residual_cents']:+.1f}",
            "-" if mode["left_out_cents"] is None else f"{mode['left_out_cents']:+.1f}",
            f"{mode['leverage']:.2f}",
        )
        for mode in summary["modes"]
    ]
    return Table(
        "Modes, Hz and cents (17 cents are about 1 %)",
        ("mode", "measured", "predicted", "90 % interval", "error", "left out", "leverage"),
        tuple(rows),
    )


def unlabelled_table(summary: Mapping[str, Any]) -> Table | None:
    """Peaks without a label beside the nearest predicted mode; None if there are none."""
    if not summary["unlabelled"]:
        return None
    rows = [
        (f"{peak['measured_hz']:.6g}", peak["nearest"], f"{peak['predicted_hz']:.1f}", f"{peak['cents']:+.0f}")
        for peak in summary["unlabelled"]
    ]
    return Table(
        "Peaks without a label: kept, not fitted", ("measured Hz", "nearest mode", "predicted Hz", "cents"), tuple(rows)
    )


def check_tables(report: Mapping[str, Any]) -> tuple[Table, ...]:
    """What `check` found: the constants with the precision to expect, the modes, and what effects would do."""
    constants = tuple(
        (
            f"{name}, {words}",
            f"{report['estimate'][name] / _GPA:.4g}",
            f"± {report['expected_sd_percent'][name]:.1f} %",
        )
        for name, words in _WORDS.items()
    )
    modes = tuple(
        (
            f"{mode['label']} {mode['setup']}" if len(report["setups"]) > 1 else mode["label"],
            f"{mode['measured_hz']:.6g}",
            f"{mode['residual_cents']:+.1f}",
            " / ".join(f"{share:.0f}" for share in mode["share_percent"]),
            f"{mode['leverage']:.2f}",
        )
        for mode in report["modes"]
    )
    return (
        Table(
            f"What {report['name']} can tell, GPa", ("constant", "least squares", "uncertainty to expect"), constants
        ),
        Table("Modes", ("mode", "measured Hz", "error, cents", "energy in D_x/D_y/D_s, %", "leverage"), modes),
        *([signatures_table(report)] if report["signatures"] else []),
    )


def signatures_table(report: Mapping[str, Any]) -> Table:
    """What effects that are not declared would do: in all, to be seen, and to the constants if ignored.

    No name of an effect may be cut off on a terminal of 80 columns, so look-alikes stand below each other.
    """
    rows = tuple(
        (
            one["effect"],
            f"{one['raw_rms_cents']:.1f}",
            f"{one['visible_rms_cents']:.1f}" + (" *" if one["below_sight"] else "  "),
            "/".join(f"{one['bias_percent'][name]:+.1f}" for name in _WORDS),
            "\n".join(one["look_alikes"]) or "-",
        )
        for one in report["signatures"]
    )
    return Table(
        "Effects not declared, at a usual size: cents rms (*: lost in noise)",
        ("effect", "shift", "visible", "E_x/E_y/G_xy\noff by, %", "looks like"),
        rows,
    )


def decimals(sd: float) -> int:
    """Decimals that show two significant digits of a standard deviation, at most six."""
    digits = 0
    while sd < 9.95 and digits < 6 and sd > 0:
        sd *= 10
        digits += 1
    return digits
