"""The tables that people read of a campaign: what is shared, who taught it, boards side by side, what is common."""

from __future__ import annotations

from collections.abc import Mapping

from bayesplate.board.parameter import unit_of_people
from bayesplate.campaign.claim import LeftOut, TaughtBoard
from bayesplate.campaign.common import CommonResidual
from bayesplate.campaign.diagnosis import CampaignDiagnosis, words_of
from bayesplate.campaign.summary import CampaignCheck, CampaignSummary, PopulationSummary, SharedNumber
from bayesplate.effects.words import effect_name
from bayesplate.results.tables import Row, Table, by_constant
from bayesplate.results.words import GPA, interval, number, percent, plus_minus

_MOST_LISTED = 8


def campaign_tables(summary: CampaignSummary) -> tuple[Table, ...]:
    """All tables of a campaign, in the order in which they are read."""
    tables = []
    if summary.shared:
        tables += [shared_table(summary.shared), *(taught_table(summary, name) for name in summary.shared)]
    tables.append(boards_table(summary))
    if summary.common_residual:
        tables.append(common_table(summary.common_residual))
    if summary.population is not None:
        tables.append(population_table(summary.population))
    return tuple(tables)


def campaign_check_tables(report: CampaignCheck) -> tuple[Table, ...]:
    """The tables of a check: what would be shared, and the boards side by side."""
    shared = []
    for name, one in report.shared.items():
        factor, unit = unit_of_people(one.unit)
        prior = f"{one.prior_q05 * factor:.2g} to {one.prior_q95 * factor:.2g} {unit}".rstrip()
        best = min(one.boards.values(), default=1.0)
        shared.append((shared_words(name), prior, number(best, 2), number(one.expected_sd, 2)))
    boards: list[Row] = []
    for board, each in report.boards.items():
        expected = (number(share, 1) for _, share in each.expected_sd_percent.items())
        boards.append((board, len(each.modes), number(each.in_sample_rms_cents, 1), *expected, each.law))
    tables = [
        Table(
            "Boards; error of weighted least squares, cents; sd to expect, %",
            ("board", "modes", "error", "E_x", "E_y", "G_xy", "law"),
            tuple(boards),
        )
    ]
    if shared:
        columns = ("shared", "90 % of its prior", "best board", "all boards")
        tables.insert(
            0, Table("What the boards would share; sd to expect over that of the prior", columns, tuple(shared))
        )
    return tuple(tables)


def diagnosis_tables(diagnosis: CampaignDiagnosis) -> tuple[Table, ...]:
    """The tables of a diagnosis: what was searched for, boards that were left out, what is common after it."""
    common = (common_table(diagnosis.common_residual),) if diagnosis.common_residual else ()
    return (*searched_tables(diagnosis), *common)


def searched_tables(diagnosis: CampaignDiagnosis) -> tuple[Table, ...]:
    """What was searched for, and the boards that were left out."""
    tables = []
    if diagnosis.explanations:
        listed = diagnosis.explanations[:_MOST_LISTED]
        probable = tuple((words_of(one), percent(one.probability, 1)) for one in listed)
        tables.append(Table("What the boards may have", ("explanation", "probability"), probable))
    if diagnosis.left_out_boards:
        rows = tuple(
            (
                board,
                number(one.log_score_gain, 1, signed=True),
                number(one.before_rms_cents, 1),
                number(one.after_rms_cents, 1),
                _p_value(one),
            )
            for board, one in diagnosis.left_out_boards.items()
        )
        title = "Boards left out, the others teaching: gain in log score, error in cents"
        tables.append(Table(title, ("board", "gain", "before", "after", "p-value"), rows))
    return tuple(tables)


def _p_value(one: LeftOut | TaughtBoard) -> str:
    return f"{one.p_value:.2g}" + (" refuses" if one.refuses else "")


def shared_words(name: str) -> str:
    """A shared parameter as people read it: "G_xz / E_x" of transverse_shear.G_xz / E_x, "attached mass"."""
    effect, _, key = name.partition(".")
    words = effect_name(effect)
    return key if "/" in key else words if words.endswith(key) else f"{key} of {words}"


def shared_name(name: str, one: SharedNumber) -> str:
    """The same with its effect and its unit."""
    unit = unit_of_people(one.all_boards.unit)[1]
    words = f"{effect_name(name.partition('.')[0])}, {shared_words(name)}" if "/" in name else shared_words(name)
    return f"{words}, {unit}" if unit else words


def shared_table(shared: Mapping[str, SharedNumber]) -> Table:
    """Each shared number from all boards."""
    rows = []
    for name, one in shared.items():
        factor = unit_of_people(one.all_boards.unit)[0]
        rows.append((shared_name(name, one), plus_minus(one.all_boards, factor), interval(one.all_boards, factor)))
        if one.scatter is not None:
            rows.append(("its scatter between boards, %", plus_minus(one.scatter, 100.0), interval(one.scatter, 100.0)))
    return Table("Shared by all boards", ("number", "mean ± sd", "90 % interval"), tuple(rows))


def taught_table(summary: CampaignSummary, name: str) -> Table:
    """One shared number: what each board says of it alone, and what the others teach that board."""
    one = summary.shared[name]
    factor = unit_of_people(one.all_boards.unit)[0]
    rows = []
    for board, own in one.own.items():
        left = summary.left_out_boards[board]
        others = plus_minus(one.others[board], factor)
        rows.append((board, plus_minus(own, factor), others, _p_value(left)))
    return Table(
        f"{shared_name(name, one)}: each board alone, and what the others teach it",
        ("board", "alone", "from the others", "p-value of the board"),
        tuple(rows),
    )


def boards_table(summary: CampaignSummary) -> Table:
    """The boards' constants side by side, GPa."""
    rows: list[Row] = []
    for board, one in summary.boards.items():
        constants = (plus_minus(entry, GPA) for _, entry in one.elastic.items())
        rows.append((board, *constants, number(one.error.in_sample_rms_cents, 1)))
    return Table("Boards, GPa; error rms, cents", ("board", "E_x", "E_y", "G_xy", "error"), tuple(rows))


def common_table(common: Mapping[str, CommonResidual]) -> Table:
    """What is left over on all boards alike, cents."""
    rows = []
    for label, one in common.items():
        each = ", ".join(str(number(value, 0, signed=True)) for value in one.boards.values())
        mean = f"{number(one.mean_cents, 1, signed=True)} ± {one.error_cents:.1f}"
        rows.append((label, mean, number(one.scatter_cents, 1), len(one.boards), each))
    return Table(
        "What is left over on all boards alike: measured over predicted, cents",
        ("mode", "mean ± error", "scatter", "boards", "each board"),
        tuple(rows),
    )


def population_table(population: PopulationSummary) -> Table:
    """The distribution of the boards' constants, and the board that comes next."""
    return by_constant(
        "Population of the boards, GPa",
        {
            "median ± sd": lambda name: plus_minus(population.mean[name], GPA),
            "spread, %": lambda name: plus_minus(population.sd_percent[name]),
            "90 % of the next board": lambda name: interval(population.next_board[name], GPA),
        },
        names=population.mean,
    )
