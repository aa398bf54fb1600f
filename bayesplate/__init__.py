"""Elastic constants of a rectangular orthotropic plate from its modal frequencies, with an honest uncertainty.

    fit(card)       board card to posterior
    check(card)     what a card can identify, without sampling
    compare(card)   every method side by side
    cite(card)      references of exactly what a fit uses

`modes(card)` is imported from `bayesplate.workflow.modes`: its name here is that of the folder of plate solutions.

Glossary of symbols
-------------------
x, y            along and across the grain
L_x, L_y, h     side lengths and thickness, m
rho             density, kg m^-3
E_x, E_y        Young's moduli along and across the grain, Pa
G_xy            in-plane shear modulus, Pa
nu_xy, nu_yx    Poisson ratios, E_x nu_yx = E_y nu_xy
D_x, D_y, D_s   rigidities, N m: D_x = E_x h^3 / 12 (1 - nu_xy nu_yx), D_y likewise, D_s = G_xy h^3 / 3
(m,n)           label of a mode: interior nodal lines crossed along x and along y, plus the laboratory's first label
a, b, c         the paper's modal coefficients: omega^2 = lambda (a D_x + b D_y + c D_s)
lambda          1 / (rho h L_x^2 L_y^2)
psi             omega^2 / lambda of a measured frequency, N m
tau             integrated autocorrelation time of the sampler, steps
cents           1200 log2 of a frequency ratio
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayesplate.workflow.check import check
    from bayesplate.workflow.cite import cite
    from bayesplate.workflow.compare import compare
    from bayesplate.workflow.fit import FitResult, fit

__all__ = ["FitResult", "check", "cite", "compare", "fit"]

_HOMES = {
    "FitResult": "bayesplate.workflow.fit",
    "check": "bayesplate.workflow.check",
    "cite": "bayesplate.workflow.cite",
    "compare": "bayesplate.workflow.compare",
    "fit": "bayesplate.workflow.fit",
}


def __getattr__(name: str) -> object:
    """Import a public name when it is first used, so that `import bayesplate` costs nothing."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'bayesplate' has no attribute {name!r}")
