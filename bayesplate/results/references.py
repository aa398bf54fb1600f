"""The references of a fit: of its model, computation, data and priors."""

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
THIN_THEORY = "Kirchhoff's thin orthotropic plate, as in eq. (1) to (4) of Ducceschi et al. [the plate theory]"
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
class ReferenceSection:
    """A heading with its references."""

    title: str
    entries: tuple[str, ...]


def references(card: Board, prior: PriorCard, board: Board) -> tuple[ReferenceSection, ...]:
    """The references of a fit of a card, with the effects that `board` declares; only of what the fit uses."""
    systems = [system_of(board, setup) for setup in board.setups]
    theory = (THIN_THEORY,) if any(system.theory == "thin" for system in systems) else ()
    effects = tuple(
        dict.fromkeys(entry for system in systems for effect in system.effects for entry in effect.references)
    )
    return (
        ReferenceSection("Model", (PAPER, *theory, ELEMENT, *effects)),
        ReferenceSection("Computation", COMPUTATION),
        ReferenceSection("Data", _data_references(card, board)),
        ReferenceSection("Prior", _prior_references(prior, board)),
    )


def _data_references(card: Board, board: Board) -> tuple[str, ...]:
    entries = [f"board {card.name}: {_single_line(card.source) or 'the card states no source'}"]
    tables = [setup.published_coefficients for setup in board.setups if setup.published_coefficients is not None]
    entries += [f"coefficients {table.name}: {_single_line(table.source)}" for table in tables]
    return tuple(dict.fromkeys(entries))


def _prior_references(prior: PriorCard, board: Board) -> tuple[str, ...]:
    """Sources of the prior card that the fit uses, and of default priors of effects."""
    sources = {name: source for name, source in prior.sources.items() if _is_prior_used(name, board)}
    entries = [f"{name} ({prior.name}): {_single_line(source)}" for name, source in sources.items()]
    for setup in board.setups:
        for effect in effects_of(board, setup):
            for parameter in effect.parameters():
                if parameter.source:
                    subject = effect.name if parameter.is_component else f"{parameter.key} ({effect.name})"
                    entries.append(f"{subject}: {_single_line(parameter.source)}")
    return tuple(dict.fromkeys(entries))


def _is_prior_used(name: str, board: Board) -> bool:
    """Whether the fit uses an entry of the prior card: Poisson ratio and noise only if the board card has none."""
    if name == "poisson_xy":
        return board.parameter("poisson_xy").is_assumed
    if name == "noise_percent":
        return any(setup.is_noise_assumed for setup in board.setups)
    return True


def _single_line(text: str) -> str:
    return " ".join(text.split())
