"""What a page says of a fit: its sentences and tables, as plain text; the template only lays them out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bayesplate.board.board import Board
from bayesplate.board.parameter import Parameter, unit_of_people
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.effects import EFFECTS
from bayesplate.effects.words import effect_name, joined
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.report.posterior import input_words
from bayesplate.results.budget import budget, row_words
from bayesplate.results.contract import Spread
from bayesplate.results.fit_tables import modes_table, peaks_table
from bayesplate.results.summary import NONE_JUDGED, TOO_FEW_LEFT, Summary
from bayesplate.results.tables import Cell, Row, Table, by_constant
from bayesplate.results.words import (
    CONSTANTS,
    GPA,
    Value,
    constant_name,
    decimals,
    number,
    percent,
    plus_minus,
    two_digits,
)

_MAKERS = (
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
    missed = f"The fit misses the frequencies by {_cents(error.in_sample_rms_cents)}"
    if left_out is None:
        too_few = "there are too few modes to test it on one that it has not seen"
        sentences.append(f"{missed}; {too_few if summary.why_no_left_out == TOO_FEW_LEFT else NONE_JUDGED}.")
    else:
        sentences.append(f"{missed}; a mode that it has not seen, by {_cents(left_out)}.")
    if summary.model.isotropic:
        entry = summary.elastic.E_x
        return [*sentences, f"The modulus is known to ± {two_digits(entry.sd / entry.mean, 100)} %."]
    share, weakest = max((entry.sd / entry.mean, name) for name, entry in summary.elastic.items())
    told = two_digits(share, 100)
    alike = all(str(two_digits(entry.sd / entry.mean, 100)) == str(told) for _, entry in summary.elastic.items())
    which = "All three are known equally well" if alike else f"Least well known is {constant_name(weakest)}"
    return [*sentences, f"{which}: ± {told} %."]


def _cents(value: float) -> str:
    return f"{two_digits(value)} cents ({two_digits(2 ** (value / 1200) - 1, 100)} %)"


def makers_table(summary: Summary) -> Table:
    derived = summary.derived
    rows: list[Row] = [
        (words, *(plus_minus(derived[f"{name}_{axis}"], factor) for axis in "xy"), unit)
        for name, words, factor, unit in _MAKERS
    ]
    return Table("What makers compare", ("", "along", "across", "unit"), tuple(rows))


def ratios_table(summary: Summary) -> Table:
    derived = summary.derived
    rows: list[Row] = [(words, plus_minus(derived[name])) for name, words in _RATIOS]
    rows.append(("density ρ, kg/m³", plus_minus(derived["density"])))
    rows += [(f"{name}, N m", plus_minus(entry)) for name, entry in summary.rigidity.items()]
    return Table("Ratios, density, rigidities", ("", "mean ± sd"), tuple(rows))


def effects_table(board: Board, summary: Summary) -> Table | None:
    """Parameters of the declared effects, a component of a field with its look; None if none is declared."""
    shapes = {(one.effect, one.key): one for one in board.parameters if one.is_component}
    rows = [
        (*_named(effect, where, parameter, shapes.get((effect, parameter))), *_measured(entry))
        for where, effects in summary.effects.items()
        for effect, parameters in effects.items()
        for parameter, entry in parameters.items()
    ]
    return Table("Effects in the model", ("effect", "parameter", "mean ± sd", "unit"), tuple(rows)) if rows else None


def _named(effect: str, where: str, parameter: str, shape: Parameter | None) -> tuple[str, str]:
    """An effect and where it acts, and what its parameter is called."""
    name = effect_name(effect)
    if shape is None:
        return f"{name}, {where}", parameter
    return f"{name}, {where}: {shape.look}", shape.words.removesuffix(f" of {name}")


def _measured(entry: Spread) -> tuple[Cell, Cell]:
    """Mean ± sd and the unit, in the unit that people use."""
    factor, unit = unit_of_people(entry.unit)
    return plus_minus(entry, factor), unit or None


def effect_sentences(summary: Summary, told: Sequence[str] = ()) -> list[str]:
    """What each effect of the model is, but for sentences that the page has told."""
    every = ((effect_name(name), EFFECTS[name].sentence) for name in summary.model.effects)
    return [f"{name}: {sentence}" for name, sentence in every if sentence not in told]


def budget_table(inference: Inference, draws: Draws, summary: Summary) -> Table:
    board = inference.problem.board
    shares = budget(draws, board)
    alone = dict(zip(CONSTANTS, inference.problem.identifiability.errors_of_rigidities, strict=True))
    named = {one.name: input_words(one, board)[0] for one in board.uncertain}

    def inputs(name: str) -> str | None:
        largest = sorted(shares[name].items(), key=lambda item: -item[1])[:2]
        told = (
            f"{named.get(key) or row_words(key, board)} {percent(share)}" for key, share in largest if share >= 0.05
        )
        return ", ".join(told) or None

    columns: dict[str, Callable[[str], Cell]] = {
        "sd": lambda name: f"{two_digits(summary.elastic[name].sd / summary.elastic[name].mean, 100)} %",
        "from the expected noise alone": lambda name: f"{two_digits(alone[name], 100)} %",
    }
    if any(map(inputs, CONSTANTS)):
        columns["share of the variance from inputs"] = inputs
    return by_constant("Where the uncertainty comes from", columns, isotropic=summary.model.isotropic)


def inputs_table(board: Board, summary: Summary) -> Table:
    rows = []
    for one in filter(lambda one: one.is_listed, board.parameters):
        words, factor, unit = input_words(one, board)
        entry = (
            summary.effects[one.owner.title][one.effect][one.key] if one.is_of_effect else summary.inputs.get(one.name)
        )
        after = None if entry is None or one.prior.is_exact else plus_minus(entry, factor)
        rows.append((f"{words}, {unit}" if unit else words, _stated(one.prior, factor), after))
    shown = 3 if any(after is not None for *_, after in rows) else 2
    columns = ("quantity", "as stated", "after the fit")
    return Table("Inputs", columns[:shown], tuple(row[:shown] for row in rows))


def _stated(quantity: Quantity, factor: float) -> str:
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
    rows = tuple((name, _prior(stated.quantity), stated.source) for name, stated in prior.stated_constants.items())
    return Table(f"Prior card {prior.name}", ("constant", "density", "source"), rows)


def _prior(quantity: Quantity) -> str:
    unit, factor = ("GPa", GPA) if quantity.median > 1e4 else ("N m", 1.0)
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
    return by_constant("Means under both frequency laws, GPa", columns, isotropic=summary.model.isotropic)


def model_rows(summary: Summary) -> list[tuple[str, str]]:
    model, error = summary.model, summary.error
    effects = joined([effect_name(name) for name in model.effects]) or "none"
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
    one, limits = summary.sampler, Gate()
    return [
        ("ensembles, walkers, steps", f"{one.ensembles}, {one.walkers}, {one.steps}"),
        (f"largest R-hat (at most {limits.rhat_max:g})", number(one.rhat_max, 4)),
        (f"smallest effective size (at least {limits.ess_min:g})", number(one.ess_min, 0)),
        ("largest autocorrelation time, steps", number(one.tau_max, 1)),
        ("accepted proposals", percent(one.acceptance)),
        *([] if one.pareto_k is None else [("Pareto k-hat of the weights to the exact law", number(one.pareto_k, 2))]),
    ]


def run_rows(summary: Summary) -> list[tuple[str, str]]:
    versions = ", ".join(f"{name} {version}" for name, version in summary.versions.items())
    return [("seed", str(summary.seed)), ("versions", versions), ("SHA-256 of the card", summary.card_sha256)]
