"""`check`: every fault of a card, or what would be fitted and what it can identify; nothing is sampled or written."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from bayesplate.diagnosis.shifts.signatures import INVISIBLE, Signature, look_alikes, signatures
from bayesplate.estimates.identifiability import remarks
from bayesplate.frequencies.laws import cents
from bayesplate.plate.material import MODULI, moduli
from bayesplate.posterior.inference import PosedProblem, pose
from bayesplate.results.checking import CheckedEffect, CheckedMode, CheckedSetup, CheckReport
from bayesplate.results.contract import Constants, Elastic
from bayesplate.workflow.arguments import require_arguments
from bayesplate.workflow.prepare import prepare

_N_DRAWS = 4000


def check(card: str | os.PathLike[str], *, effects: Sequence[str] | None = None) -> CheckReport:
    """Say what would be fitted.

    Parameters
    ----------
    card : str or path
    effects : sequence of str, optional

    Returns
    -------
    CheckReport

    Raises
    ------
    InputError, NotIdentifiableError
        As `fit` would.
    """
    require_arguments(card=card, effects=effects)
    prepared = prepare(card, effects)
    board = prepared.board
    problem = pose(board, prepared.prior)
    estimate, found = problem.estimate, problem.identifiability
    D_x, D_y, D_s = estimate.rigidities
    elastic = moduli(D_x, D_y, D_s, estimate.values["thickness"], estimate.values["poisson_xy"])
    expected = expected_sd(problem)
    rows = [(setup.name, reading) for setup in board.setups for reading in setup.readings]
    residuals = cents(estimate.residuals)
    correlations = [place.correlation for model in estimate.models for place in model.places]
    return CheckReport(
        name=board.name,
        title=board.title,
        prior=board.prior,
        law=problem.posterior.law,
        setups=tuple(
            CheckedSetup(
                setup.name, setup.edges, len(setup.readings), len(setup.unlabelled), 100.0 * setup.noise.median
            )
            for setup in board.setups
        ),
        uncertain_inputs=tuple(board.uncertain_inputs),
        estimate=Constants(*(float(value) for value in (*elastic, *estimate.rigidities))),
        expected_sd_percent=Elastic(**{name: 100.0 * value for name, value in expected.items()}),
        condition_number=found.condition_number,
        modes=tuple(
            CheckedMode(
                setup=setup,
                label=str(reading.label),
                measured_hz=reading.frequency.mean,
                residual_cents=float(residuals[i]),
                leverage=float(found.leverages[i]),
                share_percent=tuple(round(100.0 * float(share), 1) for share in found.shares[i]),
                label_correlation=correlations[i],
            )
            for i, (setup, reading) in enumerate(rows)
        ),
        in_sample_rms_cents=float(np.sqrt(np.mean(residuals**2))),
        signatures=tuple(_effects(signatures(problem))),
        invisible=INVISIBLE,
        identifiability=tuple(remarks(board, found)),
        notes=tuple(board.notes),
    )


def _effects(found: Sequence[Signature]) -> list[CheckedEffect]:
    alike = look_alikes(found)
    return [
        CheckedEffect(
            effect=one.effect,
            size=dict(one.size),
            raw_rms_cents=one.raw_rms,
            visible_rms_cents=one.visible_rms,
            below_sight=one.is_below_sight,
            bias_percent=Elastic(**one.bias_percent),
            look_alikes=alike[one.effect],
        )
        for one in found
    ]


def expected_sd(problem: PosedProblem) -> dict[str, float]:
    """Relative standard deviation of each modulus in the normal approximation of the posterior."""
    draws = np.random.default_rng(0).multivariate_normal(problem.centre, problem.covariance, _N_DRAWS)
    values = problem.parameters.values(draws)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    return {name: float(np.nanstd(np.log(v))) for name, v in zip(MODULI, constants, strict=True)}
