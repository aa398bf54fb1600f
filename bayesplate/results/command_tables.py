"""The tables of `check`, `compare` and `modes`: text cells only, no layout."""

from __future__ import annotations

from bayesplate.board.writing import toml_value
from bayesplate.effects.words import join_words
from bayesplate.results.checking import CheckReport
from bayesplate.results.comparison import MethodRow, ModulusEstimate, TheoryRow
from bayesplate.results.sheets import EnergyShares, ModesReport, SheetReport, SheetRow
from bayesplate.results.tables import Cell, Row, Table, table_by_constant
from bayesplate.results.words import (
    GPA,
    MODULUS_WORDS,
    Value,
    decimals,
    hertz_range,
    is_isotropic,
    mode_name,
    number,
    percent,
    probabilities_text,
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
_NO_MODE, _LEAST_ALTERNATIVE = "none", 0.005


def check_tables(report: CheckReport) -> tuple[Table, ...]:
    """The tables of `check`: the constants with the expected precision, the modes, the shifts by undeclared effects."""

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
        table_by_constant(
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
    """Undeclared effects: shift of the modes, the part that could be seen, bias of the constants if ignored.

    No name of an effect may be cut off on a terminal of 80 columns, so look-alikes stand below each other.
    """
    rows = tuple(
        (
            signature.effect,
            number(signature.raw_rms_cents, 1),
            f"{signature.visible_rms_cents:.1f}" + (" *" if signature.below_detection_limit else "  "),
            "/".join(str(number(bias, 1, signed=True)) for _, bias in signature.bias_percent.items()),
            "\n".join(signature.look_alikes) or None,
        )
        for signature in report.signatures
    )
    return Table(
        "Effects not declared, at a usual size: cents rms (*: lost in noise)",
        ("effect", "shift", "visible", "E_x/E_y/G_xy\noff by, %", "looks like"),
        rows,
    )


def methods_table(name: str, theory: TheoryRow) -> Table:
    """The constants of every method under one plate theory, and the rms error of each."""
    return Table(
        f"{name}, {theory.theory} plate: constants, GPa; error, cents rms",
        ("method", *MODULUS_WORDS, "error"),
        tuple(_method_cells(method, theory) for method in theory.methods),
    )


def _method_cells(method: MethodRow, theory: TheoryRow) -> tuple[Cell, ...]:
    subsets = "" if method.n_subsets is None else f" ({method.n_subsets})"
    cells = (_modulus_cell(entry, _modulus_decimals(name, theory)) for name, entry in method.elastic.items())
    return (_METHODS[method.name] + subsets, *cells, number(method.forward_rms_cents, 1))


def forward_table(theory: TheoryRow) -> Table:
    """The forward check: each reading over the exact law's prediction at a method's constants, cents."""
    several = len({mode.setup for mode in theory.modes}) > 1
    rows: list[Row] = [
        (
            mode_name(mode.label, mode.setup, several=several),
            mode.measured_hz,
            *(number(method.forward[i].cents, 1, signed=True) for method in theory.methods),
            number(mode.left_out_cents, 1, signed=True),
        )
        for i, mode in enumerate(theory.modes)
    ]
    return Table(
        f"Forward check, {theory.theory} plate: measured over predicted, cents",
        ("mode", "Hz", *(_METHODS[method.name] for method in theory.methods), "left out"),
        tuple(rows),
    )


def _modulus_decimals(name: str, theory: TheoryRow) -> int:
    """Decimals of a modulus without a standard deviation: as many as the methods that give one have."""
    sds = (method.elastic[name].sd for method in theory.methods)
    return max((decimals(sd * GPA) for sd in sds if sd), default=_DEFAULT_DIGITS)


def _modulus_cell(entry: ModulusEstimate, digits: int) -> Value:
    if entry.mean is None or not entry.sd:
        return number(entry.mean, digits, factor=GPA)
    return Value(entry.mean * GPA, entry.sd * GPA)


def sheet_tables(report: ModesReport) -> tuple[Table, ...]:
    """The labels proposed for peaks, where no peak has a label, and one table per setup."""
    tables = tuple(_sheet_table(report.name, setup) for setup in report.setups)
    return (_proposed_table(report), *tables) if report.proposed else tables


def _proposed_table(report: ModesReport) -> Table:
    """The label proposed for each peak, its probability, and the alternatives."""
    rows: list[Row] = []
    for proposal in report.proposed:
        label = proposal.label or _NO_MODE
        alternatives = {name: p for name, p in proposal.probability.items() if name != label and p > _LEAST_ALTERNATIVE}
        rows.append(
            (
                mode_name(f"{proposal.measured_hz:g}", proposal.setup, several=len(report.setups) > 1),
                label,
                percent(proposal.probability[label]),
                probabilities_text(alternatives),
            )
        )
    return Table(f"Labels proposed for the peaks of {report.name}", ("Hz", "mode", "probability", "or"), tuple(rows))


def proposal_remarks(report: ModesReport) -> tuple[str, ...]:
    """How to use proposed labels: compare the figures, then write the labels on the card."""
    if not report.proposed:
        return ()
    frequencies: dict[str, dict[str, float]] = {}
    for proposal in report.proposed:
        if proposal.label:
            frequencies.setdefault(proposal.setup, {})[proposal.label] = proposal.measured_hz
    tables = (
        f"frequencies_hz = {toml_value(labelled)}" + (f" in setup {setup}" if len(report.setups) > 1 else "")
        for setup, labelled in frequencies.items()
    )
    return (
        "no peak has a label, so these are proposals: compare the figures in sand with the sheet, then write "
        f"{join_words(tuple(tables))}",
    )


def _sheet_table(name: str, setup: SheetReport) -> Table:
    """The lowest modes of a setup: frequency, energies, the paper's coefficients."""
    has_effects = any(mode.share_percent.effects for mode in setup.modes)
    rows = tuple(
        (
            mode.label,
            number(mode.hz, 1),
            _reading_cell(mode),
            " / ".join(str(share) for share in _rounded_shares(mode.share_percent, has_effects)),
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


def _rounded_shares(shares: EnergyShares, has_effects: bool) -> list[int]:
    percentages = (shares.D_x, shares.D_y, shares.D_s, *((shares.effects,) if has_effects else ()))
    return [round(share) for share in percentages]


def _reading_cell(mode: SheetRow) -> Cell:
    if mode.likely_hz is not None:
        return hertz_range(*mode.likely_hz)
    return mode.measured_hz
