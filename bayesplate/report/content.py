"""Sentences and tables of the page of a fit, as plain text; the template only lays them out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter, display_unit
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS
from bayesplate.effects.words import effect_name, join_words
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.draws import Draws
from bayesplate.report.posterior import input_words
from bayesplate.results.budget import budget, row_words
from bayesplate.results.contract import Spread
from bayesplate.results.fit_tables import modes_table, peaks_table
from bayesplate.results.summary import ALL_MODES_CARRYING, TOO_FEW_MODES, Summary
from bayesplate.results.tables import Cell, Row, Table, table_by_constant
from bayesplate.results.words import (
    GPA,
    MODULUS_WORDS,
    Value,
    constant_name,
    decimals,
    number,
    percent,
    plus_minus,
    two_digits,
)

_MAKERS_QUANTITIES = (
    ("wave_speed", "wave speed c", 1.0, "m/s"),
    ("radiation_ratio", "radiation ratio c/ρ", 1.0, "m⁴/(kg s)"),
    ("specific_stiffness", "specific stiffness E/ρ", 1e-6, "10⁶ m²/s²"),
    ("impedance", "impedance c ρ", 1e-6, "10⁶ kg/(m² s)"),
)
_RATIOS = (("anisotropy", "E_x / E_y"), ("E_x_over_G_xy", "E_x / G_xy"))


def summary_sentences(summary: Summary) -> list[str]:
    error = summary.error
    E_x, E_y, G_xy = (plus_minus(entry, GPA) for _, entry in summary.elastic.items())
    n = len(summary.modes)
    sentences = [f"From {n} modes: {E_x} GPa along the grain, {E_y} GPa across it, and a shear modulus of {G_xy} GPa."]
    if summary.model.isotropic:
        sentences = [
            f"From {n} mode{'s' * (n != 1)}: {E_x} GPa in all directions, so that the shear modulus is {G_xy} GPa."
        ]
    left_out = error.leave_one_out_rms_cents
    error_text = f"The fit misses the frequencies by {_cents_and_percent(error.in_sample_rms_cents)}"
    if left_out is None:
        too_few = "there are too few modes to test it on one that it has not seen"
        sentences.append(
            f"{error_text}; {too_few if summary.why_no_left_out == TOO_FEW_MODES else ALL_MODES_CARRYING}."
        )
    else:
        sentences.append(f"{error_text}; a mode that it has not seen, by {_cents_and_percent(left_out)}.")
    if summary.model.isotropic:
        entry = summary.elastic.E_x
        return [*sentences, f"The modulus is known to ± {two_digits(entry.sd / entry.mean, 100)} %."]
    share, weakest = max((entry.sd / entry.mean, name) for name, entry in summary.elastic.items())
    precision = two_digits(share, 100)
    are_equal = all(
        str(two_digits(entry.sd / entry.mean, 100)) == str(precision) for _, entry in summary.elastic.items()
    )
    subject = "All three are known equally well" if are_equal else f"Least well known is {constant_name(weakest)}"
    return [*sentences, f"{subject}: ± {precision} %."]


def _cents_and_percent(value: float) -> str:
    return f"{two_digits(value)} cents ({two_digits(2 ** (value / 1200) - 1, 100)} %)"


def makers_table(summary: Summary) -> Table:
    derived = summary.derived
    rows: list[Row] = [
        (words, *(plus_minus(derived[f"{name}_{axis}"], factor) for axis in "xy"), unit)
        for name, words, factor, unit in _MAKERS_QUANTITIES
    ]
    return Table("What makers compare", ("", "along", "across", "unit"), tuple(rows))


def ratios_table(summary: Summary) -> Table:
    derived = summary.derived
    rows: list[Row] = [(words, plus_minus(derived[name])) for name, words in _RATIOS]
    rows.append(("density ρ, kg/m³", plus_minus(derived["density"])))
    rows += [(f"{name}, N m", plus_minus(entry)) for name, entry in summary.rigidity.items()]
    return Table("Ratios, density, rigidities", ("", "mean ± sd"), tuple(rows))


def effects_table(board: Board, summary: Summary) -> Table | None:
    """Parameters of the declared effects, components of a field with their shape; None if none is declared."""
    shapes = {(component.effect, component.key): component for component in board.parameters if component.is_component}
    rows = [
        (*_effect_cells(effect, owner, parameter, shapes.get((effect, parameter))), *_spread_cells(entry))
        for owner, effects in summary.effects.items()
        for effect, parameters in effects.items()
        for parameter, entry in parameters.items()
    ]
    return Table("Effects in the model", ("effect", "parameter", "mean ± sd", "unit"), tuple(rows)) if rows else None


def _effect_cells(effect: str, owner: str, parameter: str, shape: Parameter | None) -> tuple[str, str]:
    """Name of an effect with its board or setup, and name of its parameter."""
    name = effect_name(effect)
    if shape is None:
        return f"{name}, {owner}", parameter
    return f"{name}, {owner}: {shape.description}", shape.display_name.removesuffix(f" of {name}")


def _spread_cells(entry: Spread) -> tuple[Cell, Cell]:
    """Mean ± sd, and the unit for display."""
    factor, unit = display_unit(entry.unit)
    return plus_minus(entry, factor), unit or None


def effect_sentences(summary: Summary, given_sentences: Sequence[str] = ()) -> list[str]:
    """A sentence on each effect of the model, except those in `given_sentences`, which the page has already."""
    effects = ((effect_name(name), EFFECTS[name].sentence) for name in summary.model.effects)
    return [f"{name}: {sentence}" for name, sentence in effects if sentence not in given_sentences]


def budget_table(draws: Draws, summary: Summary) -> Table:
    problem = draws.problem
    board = problem.board
    shares = budget(draws, board)
    noise_sd = dict(zip(MODULUS_WORDS, problem.identifiability.errors_of_rigidities, strict=True))
    input_names = {parameter.name: input_words(parameter, board)[0] for parameter in board.uncertain}

    def inputs(name: str) -> str | None:
        largest = sorted(shares[name].items(), key=lambda item: -item[1])[:2]
        texts = (
            f"{input_names.get(key) or row_words(key, board)} {percent(share)}"
            for key, share in largest
            if share >= 0.05
        )
        return ", ".join(texts) or None

    columns: dict[str, Callable[[str], Cell]] = {
        "sd": lambda name: f"{two_digits(summary.elastic[name].sd / summary.elastic[name].mean, 100)} %",
        "from the expected noise alone": lambda name: f"{two_digits(noise_sd[name], 100)} %",
    }
    if any(map(inputs, MODULUS_WORDS)):
        columns["share of the variance from inputs"] = inputs
    return table_by_constant("Where the uncertainty comes from", columns, isotropic=summary.model.isotropic)


def inputs_table(board: Board, summary: Summary) -> Table:
    rows = []
    for parameter in filter(lambda parameter: parameter.is_listed, board.parameters):
        words, factor, unit = input_words(parameter, board)
        entry = (
            summary.effects[parameter.owner.title][parameter.effect][parameter.key]
            if parameter.is_of_effect
            else summary.inputs.get(parameter.name)
        )
        after_fit = None if entry is None or parameter.prior.is_exact else plus_minus(entry, factor)
        rows.append((f"{words}, {unit}" if unit else words, _quantity_text(parameter.prior, factor), after_fit))
    n_columns = 3 if any(after_fit is not None for *_, after_fit in rows) else 2
    columns = ("quantity", "as stated", "after the fit")
    return Table("Inputs", columns[:n_columns], tuple(row[:n_columns] for row in rows))


def _quantity_text(quantity: Quantity, factor: float) -> str:
    if quantity.is_exact:
        return f"{quantity.mean * factor:.6g} (taken as exact)"
    n = len(quantity.readings)
    readings = f", {n} reading{'s' * (n != 1)}" if n else ""
    return f"{plus_minus(quantity, factor)}{readings}"


def setups_table(board: Board) -> Table:
    rows = tuple(
        (
            setup.name,
            ", ".join(f"{edge} {word}" for edge, word in setup.edges.items()),
            f"{setup.resolution:g} Hz" if setup.resolution else "not rounded",
            f"{100 * setup.noise.median:.2g} %, to within a factor {setup.noise.factor:.3g}",
        )
        for setup in board.setups
    )
    return Table("Setups", ("setup", "edges", "readings rounded to", "noise expected"), rows)


def priors_table(prior: PriorCard) -> Table:
    rows = tuple(
        (name, _prior_text(name, stated.quantity), stated.source) for name, stated in prior.stated_constants.items()
    )
    return Table(f"Prior card {prior.name}", ("constant", "density", "source"), rows)


def _prior_text(name: str, quantity: Quantity) -> str:
    unit, factor = ("N m", 1.0) if name.startswith("D") else ("GPa", GPA)
    if quantity.kind == "log-normal":
        return f"log-normal, median {quantity.median * factor:.4g} {unit}, factor {quantity.factor:.3g}"
    return f"log-uniform, {quantity.lower * factor:.4g} to {quantity.upper * factor:.4g} {unit}"


def modes_tables(summary: Summary) -> list[Table]:
    peaks = peaks_table(summary)
    return [modes_table(summary), *([peaks] if peaks else [])]


def laws_table(summary: Summary) -> Table:
    columns = {
        words: lambda name, means=means: number(means[name], decimals(summary.elastic[name].sd * GPA), factor=GPA)
        for words, means in (("linear law", summary.linear_means), ("exact law", summary.exact_means))
    }
    return table_by_constant("Means under both frequency laws, GPa", columns, isotropic=summary.model.isotropic)


def model_rows(summary: Summary) -> list[tuple[str, str]]:
    model, error = summary.model, summary.error
    effects = join_words([effect_name(name) for name in model.effects]) or "none"
    noise = "Student's distribution (robust)" if model.robust else "normal distribution"
    return [
        ("plate theory", model.theory),
        *([("material", "isotropic: E_x and E_y are E, G_xy is E / (2 (1 + ν))")] if model.isotropic else []),
        ("frequency law", f"{model.law}; the linear one is off by {two_digits(error.linearisation_rms_cents)} cents"),
        ("declared effects", effects),
        ("noise of a reading", noise),
        ("prior card", model.prior),
        ("exact law checked", f"within {two_digits(error.exact_law_worst_cents)} cents of full solves"),
    ]


def sampler_rows(summary: Summary) -> list[tuple[str, str | Value]]:
    sampler, gate = summary.sampler, Gate()
    return [
        ("ensembles, walkers, steps", f"{sampler.ensembles}, {sampler.walkers}, {sampler.steps}"),
        (f"largest R-hat (at most {gate.rhat_max:g})", number(sampler.rhat_max, 4)),
        (f"smallest effective size (at least {gate.ess_min:g})", number(sampler.ess_min, 0)),
        ("largest autocorrelation time, steps", number(sampler.tau_max, 1)),
        ("accepted proposals", percent(sampler.acceptance)),
        *(
            []
            if sampler.pareto_k is None
            else [("Pareto k-hat of the weights to the exact law", number(sampler.pareto_k, 2))]
        ),
    ]


def run_rows(summary: Summary) -> list[tuple[str, str]]:
    versions = ", ".join(f"{name} {version}" for name, version in summary.versions.items())
    return [("seed", str(summary.seed)), ("versions", versions), ("SHA-256 of the card", summary.card_sha256)]
