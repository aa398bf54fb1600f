"""The paper's least squares: psi = X d, unweighted, with a table's coefficients or the modes' own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import load_coefficients
from bayesplate.errors import Fault, InputError
from bayesplate.estimates.least_squares import Estimate
from bayesplate.frequencies.terms import paper_coefficients
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.material import Moduli, moduli
from bayesplate.plate.setup import Setup


@dataclass(frozen=True, eq=False)
class PaperSystem:
    """The linear system psi = X d of a board.

    Attributes
    ----------
    psi : (n_modes,) array, N m
        omega^2 / lambda of the measured frequencies, lambda = 1 / (rho h A^2).
    coefficients : (n_modes, 3) array
        X: columns a, b, c.
    values : dict of float
        Nominal inputs, for the moduli.
    """

    psi: NDArray[np.float64]
    coefficients: NDArray[np.float64]
    values: Values

    def solve(self, rows: NDArray[np.intp] | slice = slice(None)) -> NDArray[np.float64]:
        """Unweighted least squares of some of the modes (all by default): d_x, d_y, d_s in N m, a (3,) array.

        References
        ----------
        Ducceschi et al., eq. (13).
        """
        return np.asarray(np.linalg.lstsq(self.coefficients[rows], self.psi[rows], rcond=None)[0])

    def moduli(self, constants: NDArray[np.float64], nu_yx: float | None = None) -> Moduli:
        """Elastic moduli of (..., 3) rigidities, Pa.

        With `nu_yx` given, the Poisson factor 1 - nu_xy nu_yx is fixed as the paper does; otherwise nu_yx follows from
        the estimate itself.

        References
        ----------
        Ducceschi et al., eq. (14).
        """
        D_x, D_y, D_s = np.moveaxis(np.asarray(constants, dtype=float), -1, 0)
        h, nu_xy = self.values["thickness"], self.values["poisson_xy"]
        if nu_yx is None:
            return moduli(D_x, D_y, D_s, h, nu_xy)
        factor = 12.0 * (1.0 - nu_xy * nu_yx) / h**3
        return Moduli(D_x * factor, D_y * factor, 3.0 * D_s / h**3)

    @property
    def condition_number(self) -> float:
        """Of the matrix X."""
        return float(np.linalg.cond(self.coefficients))


def paper_system(board: Board, estimate: Estimate) -> PaperSystem:
    """The paper's linear system of a board: published coefficients where a setup names a table, else the modes' own.

    Parameters
    ----------
    board : Board
    estimate : Estimate
        Where the modes' own coefficients are taken.

    Returns
    -------
    PaperSystem

    Raises
    ------
    InputError
        If a named table does not hold a label of the setup, or is of other edges or another aspect ratio.
    """
    values = board.nominal()
    rows = []
    psi = []
    for setup, model in zip(board.setups, estimate.models, strict=True):
        length_x, length_y = (float(side) for side in vibrating_lengths(values, setup))
        inverse_lambda = float(density(values) * values["thickness"]) * (length_x * length_y) ** 2
        psi.append((2.0 * np.pi * setup.measured) ** 2 * inverse_lambda)
        if setup.published_coefficients is None:
            nu_xy = float(values["poisson_xy"])
            rows.append(paper_coefficients(model.linear.stiffness, length_x / length_y, nu_xy))
        else:
            rows.append(published_coefficients(board.name, setup, length_x / length_y))
    return PaperSystem(np.concatenate(psi), np.concatenate(rows), values)


def published_coefficients(board_name: str, setup: Setup, aspect_ratio: float) -> NDArray[np.float64]:
    """Rows a, b, c of a setup's labels from the table it names: (n_modes, 3) array.

    Raises
    ------
    InputError
        If the table does not fit the setup.
    """
    card = load_coefficients(str(setup.published_coefficients))
    place = f"{board_name} [setup] published_coefficients"
    faults = []
    if card.edges.words != setup.edges:
        faults.append(
            Fault(place, f"a table for the edges {_words(setup.edges)}", f"{card.name} for {_words(card.edges.words)}")
        )
    if abs(card.aspect_ratio / aspect_ratio - 1.0) > 0.01:
        faults.append(Fault(place, f"a table of aspect ratio {aspect_ratio:.4g}", f"{card.aspect_ratio:.4g}"))
    missing = [str(label) for label in setup.labels if label not in card.table]
    if missing:
        known = ", ".join(str(label) for label in card.table)
        faults.append(Fault(place, f"a table with the labels {', '.join(missing)}", f"{card.name} with {known}"))
    if faults:
        raise InputError(faults)
    return np.array([card.table[label] for label in setup.labels])


def _words(edges: Mapping[str, str]) -> str:
    return ", ".join(f"{edge} {word}" for edge, word in edges.items())
