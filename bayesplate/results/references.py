"""The references of what a fit uses: its model, its computation, its data and its priors; kept here alone."""

from __future__ import annotations

from dataclasses import dataclass

from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.effects import effects_of
from bayesplate.frequencies.system import system_of

PAPER = (
    "M. Ducceschi, S. Duran, H. Tahvanainen, L. Ausiello: A method to estimate the rectangular orthotropic plate "
    "elastic constants using least-squares and Chladni patterns. [the frequency model, least squares, the percentile "
    "method]"
)
ELEMENT = (
    "F. K. Bogner, R. L. Fox, L. A. Schmit: The generation of inter-element-compatible stiffness and mass matrices "
    "by the use of interpolation formulas. Proc. Conf. Matrix Methods in Structural Mechanics, Wright-Patterson AFB, "
    "397-443 (1965). [the plate's finite elements]"
)
THIN = "Kirchhoff's thin orthotropic plate, as in eq. (1) to (4) of Ducceschi et al. [the plate theory]"
COMPUTATION = (
    "C. R. Harris et al.: Array programming with NumPy. Nature 585, 357-362 (2020), doi:10.1038/s41586-020-2649-2. "
    "[arrays, small eigenvalue problems]",
    "P. Virtanen et al.: SciPy 1.0: fundamental algorithms for scientific computing in Python. Nature Methods 17, "
    "261-272 (2020), doi:10.1038/s41592-019-0686-2. [sparse eigenvalue problems, special functions]",
    "D. Foreman-Mackey, D. W. Hogg, D. Lang, J. Goodman: emcee: The MCMC hammer. PASP 125, 306-312 (2013), "
    "doi:10.1086/670067. [sampling]",
    "J. Goodman, J. Weare: Ensemble samplers with affine invariance. Comm. Appl. Math. Comp. Sci. 5, 65-80 (2010), "
    "doi:10.2140/camcos.2010.5.65. [sampling]",
    "A. Vehtari, A. Gelman, D. Simpson, B. Carpenter, P.-C. Bürkner: Rank-normalization, folding, and localization: an "
    "improved R-hat for assessing convergence of MCMC. Bayesian Analysis 16, 667-718 (2021), doi:10.1214/20-BA1221. "
    "[convergence]",
    "T. Gustafsson, G. D. McBain: scikit-fem: A Python package for finite element assembly. JOSS 5, 2369 (2020), "
    "doi:10.21105/joss.02369. [finite elements]",
    "R. Kumar, C. Carroll, A. Hartikainen, O. Martin: ArviZ, a unified library for exploratory analysis of Bayesian "
    "models in Python. JOSS 4, 1143 (2019), doi:10.21105/joss.01143. [the format of posterior.nc]",
)


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it."""

    title: str
    entries: tuple[str, ...]


def references(card: Board, prior: PriorCard, board: Board) -> tuple[Section, ...]:
    """What to cite for a fit of a card, whose effects the board declares: nothing that the fit does not use."""
    systems = [system_of(board, setup) for setup in board.setups]
    theory = (THIN,) if any(system.theory == "thin" for system in systems) else ()
    effects = tuple(dict.fromkeys(entry for system in systems for one in system.effects for entry in one.references))
    return (
        Section("Model", (PAPER, *theory, ELEMENT, *effects)),
        Section("Computation", COMPUTATION),
        Section("Data", _data(card, board)),
        Section("Prior", _priors(prior, board)),
    )


def _data(card: Board, board: Board) -> tuple[str, ...]:
    entries = [f"board {card.name}: {_one_line(card.source) or 'the card states no source'}"]
    tables = [setup.published_coefficients for setup in board.setups if setup.published_coefficients is not None]
    entries += [f"coefficients {table.name}: {_one_line(table.source)}" for table in tables]
    return tuple(dict.fromkeys(entries))


def _priors(prior: PriorCard, board: Board) -> tuple[str, ...]:
    """Sources of the prior card that the fit uses, and of the priors of effects that the board card does not state."""
    used = {name: source for name, source in prior.sources.items() if _is_used(name, board)}
    entries = [f"{name} ({prior.name}): {_one_line(source)}" for name, source in used.items()]
    for setup in board.setups:
        for effect in effects_of(board, setup):
            for parameter in effect.parameters():
                if parameter.source:
                    what = effect.name if parameter.is_component else f"{parameter.key} ({effect.name})"
                    entries.append(f"{what}: {_one_line(parameter.source)}")
    return tuple(dict.fromkeys(entries))


def _is_used(name: str, board: Board) -> bool:
    """A prior's Poisson ratio and noise serve only where the board card does not state its own."""
    if name == "poisson_xy":
        return board.parameter("poisson_xy").is_assumed
    if name == "noise_percent":
        return any(setup.is_noise_assumed for setup in board.setups)
    return True


def _one_line(text: str) -> str:
    return " ".join(text.split())
