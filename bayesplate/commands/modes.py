"""`modes`: the lowest modes of a board, as a table and as a sheet of Chladni figures to print."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from bayesplate.board.board import Values
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.options import CARD, Effects, Force, Out, Seed, SetupFile
from bayesplate.commands.prepare import CardSource, PreparedBoard
from bayesplate.commands.printout import Printout, show_modes
from bayesplate.commands.problem import Problem, as_problem
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.identifiability import identifiability, require_identifiable, require_labels
from bayesplate.estimates.least_squares import weighted_least_squares, with_read_setups
from bayesplate.estimates.sheet import NUMBERS_OF_MODES, Precision, Sheet, sheet
from bayesplate.files import make_folder, require_new_files
from bayesplate.frequencies.prior_bands import prior_bands, prior_medians
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.first_labels import probable_labellings
from bayesplate.posterior.laplace import noise_widenings
from bayesplate.report.plots import ModesPlots
from bayesplate.results.sheets import ModesReport, proposed_labels, sheet_report

_AT_ESTIMATE = "at the weighted least-squares estimate"
_AT_PROPOSED = "at the weighted least-squares estimate with the labels proposed"
_AT_PRIOR = "at the median of the prior"


@dataclass(frozen=True, eq=False, repr=False)
class ModesResult:
    """Result of `modes`.

    Attributes
    ----------
    summary : ModesReport
        Frequencies, energy shares, the paper's coefficients.
    sheets : tuple of Sheet
        The same with the shapes of the modes, one per setup.
    files : tuple of Path
        Those that were written.
    """

    summary: ModesReport
    sheets: tuple[Sheet, ...]
    files: tuple[Path, ...]

    @property
    def plot(self) -> ModesPlots:
        """The sheets of Chladni figures: `result.plot.modes()`."""
        return ModesPlots(self.sheets)

    def __repr__(self) -> str:
        return repr(self.summary).replace("<ModesReport", "<ModesResult", 1)

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_modes(self.summary)

    def _repr_html_(self) -> str:
        return self.printout().html(self.summary.title or self.summary.name)


@check_arguments()
def modes(
    card: Annotated[Problem | CardSource, CARD],
    *,
    out: Out = None,
    effects: Effects = None,
    setup: SetupFile = None,
    seed: Seed = 1,
    force: Force = False,
) -> ModesResult:
    """Compute the lowest modes of a board and draw them.

    Parameters
    ----------
    card : Problem, str, path or Board
        A problem, the name of a shipped board card, the path of a card, or a board made in Python. A card or a board
        may be without frequencies: then the modes are those of the prior's median, with the range in which the prior
        expects each. Modes that were not measured have the range that the measured ones predict. Peaks alone,
        without a label, are given the most probable labels.
    out : path, optional
        Folder of modes.png and modes.svg (modes-SETUP.png where there are several setups); nothing is written without
        it.
    effects : sequence of str, optional
        Declared effects in place of the card's.
    setup : path, optional
        A file with a table [setup] that takes the place of the card's, key by key: what `pick` writes.
    seed : int
        Of the draws from the prior.
    force : bool
        Replace sheets that are there.

    Returns
    -------
    ModesResult

    Raises
    ------
    InputError
        If the card or the folder cannot be used; then nothing is written.
    """
    prepared = as_problem(card, effects=effects, setup=setup, may_lack_frequencies=True).prepared
    board = prepared.board
    stems = ["modes"] if len(board.setups) == 1 else [f"modes-{setup.name}" for setup in board.setups]
    names = [f"{stem}.{ending}" for stem in stems for ending in ("png", "svg")]
    files = () if out is None else require_new_files(Path(out), names, force=force)
    rng = np.random.default_rng(seed)
    labellings = probable_labellings(board, prepared.prior)
    if labellings:
        prepared = replace(prepared, board=labellings[0][0].board)
    values, precision, reasons = _constants(prepared)
    basis = _AT_PRIOR if precision is None else _AT_PROPOSED if labellings else _AT_ESTIMATE
    sheets = tuple(_sheets(prepared, values, precision, rng, basis))
    if out is not None:
        _save_sheets(sheets, Path(out), files)
    report = ModesReport(
        name=board.name,
        title=board.title,
        basis=basis,
        setups=tuple(sheet_report(setup_sheet) for setup_sheet in sheets),
        proposed=proposed_labels(board, labellings),
        notes=(*reasons, *board.notes),
        files=tuple(str(path) for path in files),
    )
    return ModesResult(report, sheets, files)


def _constants(prepared: PreparedBoard) -> tuple[Values, Precision | None, list[str]]:
    """Constants of the modes, their precision, and the reason if they are not the board's own estimate."""
    board, read_board = prepared.board, with_read_setups(prepared.board)
    try:
        require_labels(read_board)
        estimate = weighted_least_squares(read_board)
        require_identifiable(board, identifiability(estimate.sensitivities, estimate.scales, board.symmetry))
    except NotIdentifiableError as error:
        return prior_medians(board, prepared.prior), None, [str(error)] * bool(read_board.setups)
    widenings = noise_widenings(read_board, estimate.residuals)
    scales = estimate.scales * np.repeat(widenings, [len(setup.readings) for setup in read_board.setups])
    noise = {setup.name: setup.noise.median for setup in board.setups}
    noise |= {name: noise[name] * w for name, w in zip([s.name for s in read_board.setups], widenings, strict=True)}
    identification = identifiability(estimate.sensitivities, scales, board.symmetry)
    return {**board.nominal(), **estimate.values}, Precision(identification.of_rigidities, noise), []


def _sheets(
    prepared: PreparedBoard, values: Values, precision: Precision | None, rng: np.random.Generator, basis: str
) -> list[Sheet]:
    board, sheets = prepared.board, []
    for setup in board.setups:
        system = system_of(board, setup)
        bands = None
        if precision is None:
            _, named_modes = spectrum(system, values, NUMBERS_OF_MODES[-1])
            labels = [mode.label for mode in named_modes if mode.label is not None]
            bands = prior_bands(board, prepared.prior, setup, labels, rng)
        sheets.append(sheet(board, system, values, basis, bands, precision))
    return sheets


def _save_sheets(sheets: Sequence[Sheet], folder: Path, files: Sequence[Path]) -> None:
    from bayesplate.report.chladni import chladni_sheet
    from bayesplate.report.saving import matplotlib_defaults, save_figure

    make_folder(folder)
    for i, setup_sheet in enumerate(sheets):
        with matplotlib_defaults():
            figure = chladni_sheet(setup_sheet)
            for path in files[2 * i : 2 * i + 2]:
                save_figure(figure, path)
