"""Plates against what is known of them: the closed form of a supported plate, and the paper's printed constants."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bayesplate.board.material import rigidities
from bayesplate.commands.prepare import prepare
from bayesplate.estimates.paper import paper_system
from bayesplate.estimates.percentile import percentile_estimate
from bayesplate.plate.solve import solve
from bayesplate.plate.thin import thin_plate
from bayesplate.posterior.posing import pose
from computations.markdown import BLUE, GREEN, VERMILLION, empty_figure, figure, signed, table
from designs import E_X, E_Y, G_XY

L_X, L_Y, H, RHO, NU_XY = 0.223, 0.114, 0.003, 473.9, 0.51
"""The plate of the paper's simulations: m, kg/m^3."""
ELEMENTS = (4, 6, 8, 12, 16, 24)
N_MODES = 6

PRINTED = {
    "finnish-spruce-cantilever": {"E_x": 13.0, "E_y": 0.702, "G_xy": 0.668},
    "fiemme-spruce-clamped": {"E_x": 10.4, "E_y": 1.003, "G_xy": 0.530},
}
"""The paper's table of results by the percentile method, GPa."""


def convergence(folder: Path) -> str:
    """Errors of the lowest modes of a plate supported all round, by mesh, and the order at which they fall."""
    from bayesplate.frequencies.laws import cents

    constants = rigidities(E_X, E_Y, G_XY, H, NU_XY)
    exact = _supported(constants)
    weights = _weights(constants)
    errors = []
    for n in ELEMENTS:
        solved = solve(thin_plate(("supported",) * 2, ("supported",) * 2, n, n), weights, N_MODES).eigenvalues
        errors.append(cents(0.5 * np.log(solved[:N_MODES] / exact)))
    errors = np.array(errors)
    orders = -np.polyfit(np.log(ELEMENTS), np.log(errors), 1)[0]
    drawn, (panel,) = empty_figure(2.9)
    marks = zip((0, N_MODES // 2, N_MODES - 1), ("o", "s", "^"), (BLUE, GREEN, VERMILLION), strict=True)
    for i, mark, colour in marks:
        panel.loglog(ELEMENTS, errors[:, i], marker=mark, color=colour, ms=5, lw=1.2, label=f"mode {i + 1}")
    panel.loglog(ELEMENTS, errors[0].max() * (ELEMENTS[0] / np.array(ELEMENTS)) ** 4, color="0.5", ls=":", lw=1.2)
    panel.set_xticks(ELEMENTS, [str(n) for n in ELEMENTS])
    panel.set_xticks([], minor=True)
    panel.set_xlabel("elements along each side (dotted: fourth power)")
    panel.set_ylabel("error, cents")
    panel.legend(frameon=False, fontsize=8)
    alt = "error of three modes against the number of elements on logarithmic scales, falling along lines of slope four"
    said = (
        f"\nOf the {N_MODES} lowest modes the error falls with a power of {orders.min():.2f} to {orders.max():.2f} of "
        f"the mesh size, and is {errors[-1].max():.4f} cents at most with {ELEMENTS[-1]} elements a side.\n"
    )
    return figure(drawn, folder, "convergence", alt) + said


def _supported(constants: object) -> np.ndarray:
    """Eigenvalues omega^2 of the lowest modes in closed form, s^-2."""
    D_x, D_y, D_s = constants
    m, n = np.meshgrid(np.arange(1, 12), np.arange(1, 12))
    x, y = np.pi * m / L_X, np.pi * n / L_Y
    energy = D_x * x**4 + D_y * y**4 + (D_s + 2 * NU_XY * D_y) * x**2 * y**2
    return np.sort(energy.ravel() / (RHO * H))[:N_MODES]


def _weights(constants: object) -> object:
    """What the terms of this plate weigh."""
    from bayesplate.frequencies.terms import term_weights

    board = prepare("finnish-spruce-cantilever").board
    (setup,) = board.setups
    values = {**board.nominal(), **constants._asdict(), "length_x": np.asarray(L_X), "length_y": np.asarray(L_Y)}
    values |= {"thickness": np.asarray(H), "density": np.asarray(RHO), "poisson_xy": np.asarray(NU_XY)}
    values |= {name: np.asarray(0.0) for name in board.inputs if name.startswith("clamped")}
    return term_weights(values, setup).at(0)


def paper_table(folder: Path) -> str:
    """The percentile method on the paper's two boards, beside the paper's printed table."""
    parts = []
    for card, wanted in PRINTED.items():
        rows = []
        prepared = prepare(card)
        problem = pose(prepared.board, prepared.prior)
        found = percentile_estimate(paper_system(problem.board, problem.estimate))
        for name, value in wanted.items():
            here = found.mean[name] / 1e9
            rows.append((f"`{name}`", f"{value:.3f}", f"{here:.3f}", signed(100 * (here / value - 1))))
        columns = ("constant", "printed, GPa", "here, GPa", "difference, %")
        parts.append(f"`{card}`, percentile method:\n\n{table(columns, rows)}")
    return "\n".join(parts)
