"""The tables of `check`, `compare` and `modes`: text cells only, no layout."""

from __future__ import annotations

from bayesplate.results.checking import CheckReport
from bayesplate.results.comparison import Estimated, MethodRow, TheoryRow
from bayesplate.results.sheets import EnergyShares, ModesReport, SheetReport, SheetRow
from bayesplate.results.tables import Cell, Row, Table, by_constant
from bayesplate.results.words import (
    CONSTANTS,
    GPA,
    Value,
    chances,
    decimals,
    is_isotropic,
    mode_name,
    number,
    percent,
    two_digits,
)

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
_WHOLE_HZ = 100.0
_NO_MODE, _LEAST_TOLD = "none", 0.005


def check_tables(report: CheckReport) -> tuple[Table, ...]:
    """What `check` found: the constants with the precision to expect, the modes, and what effects would do."""

    def estimate(name: str) -> Value:
        value = report.estimate[name]
        return number(value, decimals(value * report.expected_sd_percent[name] / 100 * GPA), factor=GPA)

    modes = tuple(
        (
            mode_name(mode.label, mode.setup, several=len(report.setups) > 1),
            mode.measured_hz,
            number(mode.residual_cents, 1, signed=True),
            " / ".join(str(number(share, 0)) for share in mode.share_percent),
            number(mode.leverage, 2),
        )
        for mode in report.modes
    )
    return (
        by_constant(
            f"What {report.name} can tell, GPa",
            {
                "weighted least squares": estimate,
                "uncertainty to expect": lambda name: f"± {two_digits(report.expected_sd_percent[name])} %",
            },
            isotropic=is_isotropic(dict(report.estimate.items())),
        ),
        Table(
            "Modes; leverage near 1: nothing checks that reading",
            ("mode", "measured Hz", "error, cents", "energy in D_x/D_y/D_s, %", "leverage"),
            modes,
        ),
        *([_effects_table(report)] if report.signatures else []),
    )


def _effects_table(report: CheckReport) -> Table:
    """What effects that are not declared would do: in all, to be seen, and to the constants if ignored.

    No name of an effect may be cut off on a terminal of 80 columns, so look-alikes stand below each other.
    """
    rows = tuple(
        (
            one.effect,
            number(one.raw_rms_cents, 1),
            f"{one.visible_rms_cents:.1f}" + (" *" if one.below_detection_limit else "  "),
            "/".join(str(number(bias, 1, signed=True)) for _, bias in one.bias_percent.items()),
            "\n".join(one.look_alikes) or None,
        )
        for one in report.signatures
    )
    return Table(
        "Effects not declared, at a usual size: cents rms (*: lost in noise)",
        ("effect", "shift", "visible", "E_x/E_y/G_xy\noff by, %", "looks like"),
        rows,
    )


def methods_table(name: str, theory: TheoryRow) -> Table:
    """The constants of every method under one theory of the plate, and how far each misses the readings."""
    return Table(
        f"{name}, {theory.theory} plate: constants, GPa; error, cents rms",
        ("method", *CONSTANTS, "error"),
        tuple(_method_cells(method, theory) for method in theory.methods),
    )


def _method_cells(method: MethodRow, theory: TheoryRow) -> tuple[Cell, ...]:
    subsets = "" if method.n_subsets is None else f" ({method.n_subsets})"
    cells = (_constant(entry, _digits(name, theory)) for name, entry in method.elastic.items())
    return (_METHODS[method.name] + subsets, *cells, number(method.forward_rms_cents, 1))


def forward_table(theory: TheoryRow) -> Table:
    """The forward check: each reading over what the exact law predicts at a method's constants, cents."""
    several = len({mode.setup for mode in theory.modes}) > 1
    rows: list[Row] = [
        (
            mode_name(mode.label, mode.setup, several=several),
            mode.measured_hz,
            *(number(method.forward[i].cents, 1, signed=True, factor=-1.0) for method in theory.methods),
            number(mode.left_out_cents, 1, signed=True),
        )
        for i, mode in enumerate(theory.modes)
    ]
    return Table(
        f"Forward check, {theory.theory} plate: measured over predicted, cents",
        ("mode", "Hz", *(_METHODS[method.name] for method in theory.methods), "left out"),
        tuple(rows),
    )


def _digits(name: str, theory: TheoryRow) -> int:
    """Decimals of a modulus without a standard deviation: those of the methods that give one."""
    every = (method.elastic[name].sd for method in theory.methods)
    return max((decimals(sd * GPA) for sd in every if sd), default=_DEFAULT_DIGITS)


def _constant(entry: Estimated, digits: int) -> Value:
    if entry.mean is None or not entry.sd:
        return number(entry.mean, digits, factor=GPA)
    return Value(entry.mean * GPA, entry.sd * GPA)


def sheet_tables(report: ModesReport) -> tuple[Table, ...]:
    """What the peaks may be, where none has a label, and one table per setup."""
    tables = tuple(_sheet_table(report.name, setup) for setup in report.setups)
    return (_proposed_table(report), *tables) if report.proposed else tables


def _proposed_table(report: ModesReport) -> Table:
    """The labels proposed for bare peaks, how probable each is, and what else it may be."""
    rows: list[Row] = []
    for one in report.proposed:
        label = one.label or _NO_MODE
        others = {name: p for name, p in one.probability.items() if name != label and p > _LEAST_TOLD}
        rows.append((one.measured_hz, label, percent(one.probability[label]), chances(others)))
    return Table(f"Labels proposed for the peaks of {report.name}", ("Hz", "mode", "probability", "or"), tuple(rows))


def proposal_remarks(report: ModesReport) -> tuple[str, ...]:
    """What to do with proposed labels: look at the figures, then write them on the card."""
    if not report.proposed:
        return ()
    lines = ", ".join(f'"{one.label}" = {one.measured_hz:g}' for one in report.proposed if one.label)
    return (
        "no peak has a label, so these are proposals: compare the figures in sand with the sheet, then write "
        f"frequencies_hz = {{ {lines} }}",
    )


def _sheet_table(name: str, setup: SheetReport) -> Table:
    """The lowest modes of a setup: frequency, energies, the paper's coefficients."""
    has_effects = any(mode.share_percent.effects for mode in setup.modes)
    rows = tuple(
        (
            mode.label,
            number(mode.hz, 1),
            _reading(mode),
            " / ".join(str(share) for share in _shares(mode.share_percent, has_effects)),
            *(f"{coefficient:.4g}" for coefficient in (mode.a, mode.b, mode.c)),
        )
        for mode in setup.modes
    )
    energy = "% in D_x/D_y/D_s" + ("/rest" if has_effects else "")
    is_expected = any(mode.likely_hz for mode in setup.modes)
    is_read = any(mode.measured_hz for mode in setup.modes) or not is_expected
    read = " or\n".join(["measured"] * is_read + ["likely"] * is_expected) + " Hz"
    return Table(
        f"Lowest modes of {name}, setup {setup.setup}, {setup.theory} plate",
        ("mode", "Hz", read, energy, "a", "b", "c"),
        rows,
    )


def _shares(shares: EnergyShares, has_effects: bool) -> list[int]:
    wanted = (shares.D_x, shares.D_y, shares.D_s, *((shares.effects,) if has_effects else ()))
    return [round(share) for share in wanted]


def _reading(mode: SheetRow) -> Cell:
    if mode.likely_hz is not None:
        return " to ".join(f"{end:.1f}" if end < _WHOLE_HZ else f"{end:.0f}" for end in mode.likely_hz)
    return mode.measured_hz
