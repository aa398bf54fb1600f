"""The tables of a campaign: shared numbers, their values by board, constants by board, common residuals."""

from __future__ import annotations

from collections.abc import Mapping

from bayesplate.board.parameter import display_unit
from bayesplate.campaign.claim import LeftOutBoard, TaughtBoard
from bayesplate.campaign.common import CommonResidual
from bayesplate.campaign.diagnosis import CampaignDiagnosis, sharing_words
from bayesplate.campaign.summary import CampaignCheck, CampaignSummary, PopulationSummary, SharedNumber
from bayesplate.effects.words import effect_name
from bayesplate.results.tables import Row, Table, table_by_constant
from bayesplate.results.words import GPA, interval, number, percent, plus_minus

_MOST_LISTED = 8


def campaign_tables(summary: CampaignSummary) -> tuple[Table, ...]:
    """All tables of a campaign in reading order."""
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
    """The tables of a check: the shared numbers, and the boards side by side."""
    shared = []
    for name, checked_number in report.shared.items():
        factor, unit = display_unit(checked_number.unit)
        prior = f"{checked_number.prior_q05 * factor:.2g} to {checked_number.prior_q95 * factor:.2g} {unit}".rstrip()
        best = min(checked_number.boards.values())
        shared.append((shared_words(name), prior, number(best, 2), number(checked_number.expected_sd, 2)))
    boards: list[Row] = []
    for board, board_report in report.boards.items():
        expected = (number(share, 1) for _, share in board_report.expected_sd_percent.items())
        boards.append(
            (board, len(board_report.modes), number(board_report.in_sample_rms_cents, 1), *expected, board_report.law)
        )
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
    """The tables of a diagnosis: explanations, boards left out, and common residuals after it."""
    common = (common_table(diagnosis.common_residual),) if diagnosis.common_residual else ()
    return (*searched_tables(diagnosis), *common)


def searched_tables(diagnosis: CampaignDiagnosis) -> tuple[Table, ...]:
    """The tables of the explanations and of the boards left out."""
    tables = []
    if diagnosis.explanations:
        listed_explanations = diagnosis.explanations[:_MOST_LISTED]
        explanation_rows = tuple(
            (sharing_words(explanation), percent(explanation.probability, 1)) for explanation in listed_explanations
        )
        tables.append(Table("What the boards may have", ("explanation", "probability"), explanation_rows))
    if diagnosis.left_out_boards:
        rows = tuple(
            (
                board,
                number(left_out.log_score_gain, 1, signed=True),
                number(left_out.before_rms_cents, 1),
                number(left_out.after_rms_cents, 1),
                _p_value(left_out),
            )
            for board, left_out in diagnosis.left_out_boards.items()
        )
        title = "Boards left out, the others teaching: gain in log score, error in cents"
        tables.append(Table(title, ("board", "gain", "before", "after", "p-value"), rows))
    return tuple(tables)


def _p_value(left_out: LeftOutBoard | TaughtBoard) -> str:
    return f"{left_out.p_value:.2g}" + (" disagrees" if left_out.refuses else "")


def shared_words(name: str) -> str:
    """A shared parameter in words: "G_xz / E_x" for transverse_shear.G_xz / E_x, "attached mass"."""
    effect, _, key = name.partition(".")
    words = effect_name(effect)
    return key if "/" in key else words if words.endswith(key) else f"{key} of {words}"


def shared_name(name: str, shared_number: SharedNumber) -> str:
    """A shared parameter in words, with its effect and its unit."""
    unit = display_unit(shared_number.all_boards.unit)[1]
    words = f"{effect_name(name.partition('.')[0])}, {shared_words(name)}" if "/" in name else shared_words(name)
    return f"{words}, {unit}" if unit else words


def shared_table(shared: Mapping[str, SharedNumber]) -> Table:
    """Each shared number from all boards."""
    rows = []
    for name, shared_number in shared.items():
        factor = display_unit(shared_number.all_boards.unit)[0]
        rows.append(
            (
                shared_name(name, shared_number),
                plus_minus(shared_number.all_boards, factor),
                interval(shared_number.all_boards, factor),
            )
        )
        if shared_number.scatter is not None:
            rows.append(
                (
                    "its scatter between boards, %",
                    plus_minus(shared_number.scatter, 100.0),
                    interval(shared_number.scatter, 100.0),
                )
            )
    return Table("Shared by all boards", ("number", "mean ± sd", "90 % interval"), tuple(rows))


def taught_table(summary: CampaignSummary, name: str) -> Table:
    """One shared number from each board alone, and from the other boards."""
    shared_number = summary.shared[name]
    factor = display_unit(shared_number.all_boards.unit)[0]
    rows = []
    for board, own_spread in shared_number.own.items():
        left_out = summary.left_out_boards[board]
        taught = plus_minus(shared_number.others[board], factor)
        rows.append((board, plus_minus(own_spread, factor), taught, _p_value(left_out)))
    return Table(
        f"{shared_name(name, shared_number)}: each board alone, and what the others teach it",
        ("board", "alone", "from the others", "p-value of the board"),
        tuple(rows),
    )


def boards_table(summary: CampaignSummary) -> Table:
    """The boards' constants side by side, GPa."""
    rows: list[Row] = []
    for board, board_summary in summary.boards.items():
        constants = (plus_minus(entry, GPA) for _, entry in board_summary.elastic.items())
        rows.append((board, *constants, number(board_summary.error.in_sample_rms_cents, 1)))
    return Table("Boards, GPa; error rms, cents", ("board", "E_x", "E_y", "G_xy", "error"), tuple(rows))


def common_table(common: Mapping[str, CommonResidual]) -> Table:
    """The residuals that all boards have in common, cents."""
    rows = []
    for label, residual in common.items():
        board_cents = ", ".join(str(number(value, 0, signed=True)) for value in residual.boards.values())
        mean = f"{number(residual.mean_cents, 1, signed=True)} ± {residual.error_cents:.1f}"
        rows.append((label, mean, number(residual.scatter_cents, 1), len(residual.boards), board_cents))
    return Table(
        "What is left over on all boards alike: measured over predicted, cents",
        ("mode", "mean ± error", "scatter", "boards", "each board"),
        tuple(rows),
    )


def population_table(population: PopulationSummary) -> Table:
    """The distribution of the boards' constants, and the board that comes next."""
    return table_by_constant(
        "Population of the boards, GPa",
        {
            "median ± sd": lambda name: plus_minus(population.mean[name], GPA),
            "spread, %": lambda name: plus_minus(population.sd_percent[name]),
            "90 % of the next board": lambda name: interval(population.next_board[name], GPA),
        },
        names=population.mean,
    )
