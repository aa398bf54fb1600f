"""What the boards of a design share: laws of all forms, the law without effects, and null simulations by setting.

Each is made once a process, around the noiseless board of the design's median constants: a full solve of all forms
takes ten times as long as all the rest of a board, and null simulations of a board longer than its search.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from generator.boards import PlantedBoard, plant
from generator.designs import MEDIANS
from made_baselines import baseline_at
from numpy.typing import NDArray
from validation.trial.cells import KINDS, SENSORS, UNKNOWN, Setting

from bayesplate.board.board import Board
from bayesplate.board.material import RIGIDITIES
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import Form, forms
from bayesplate.diagnosis.laws import FormLaw, form_law
from bayesplate.diagnosis.null_control import NullControl, force_choices, null_control
from bayesplate.diagnosis.search import SearchGround, prepare_search
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.refit import Predict
from bayesplate.frequencies.laws import ExactLaw
from bayesplate.frequencies.model import SetupModel
from bayesplate.posterior.laplace import exact_models
from bayesplate.posterior.parameters import Parameters

Floats = NDArray[np.float64]

HALF_WIDTH = 0.6
"""Of the shared laws in ln D_x / D_s and ln D_y / D_s: boards of a design spread by 0.17 and 0.18."""


def baseline_of_card(planted: PlantedBoard) -> Baseline:
    """Read the card and fit the ideal board, as a user would; nothing else of the planted board is looked at."""
    board, estimate = _fitted(planted)
    return baseline_at(board, estimate, law_without_effect(planted.design.name, estimate))


def ground_of(planted: PlantedBoard, law: Any = form_law) -> SearchGround:
    """Everything that the search needs of a board, each form by a given law."""
    return prepare_search(baseline_of_card(planted), law)


def shared_law(baseline: Baseline, form: Form) -> FormLaw:
    """The law of a form that the boards of a design share; the search finds the board's modes in it."""
    return _laws(baseline.board.title.rpartition(", ")[2])[form.title]


def law_without_effect(design: str, estimate: Estimate) -> Predict:
    """The exact law of a design's bare board, for the modes that the labels of a board mean at its estimate.

    Parameters
    ----------
    design : str
    estimate : Estimate
        Of a board of that design: its sizes are those of all others, its labels may stand at other ranks.

    Returns
    -------
    callable
        (n, 3) array of ln D (N m) -> (n, n_modes) array of ln f (Hz).
    """
    models = []
    for shared, own in zip(_bare_models(design), estimate.models, strict=True):
        assert shared.exact is not None
        reduced = replace(shared.exact.reduced, places=own.places)
        models.append(replace(shared, places=own.places, exact=ExactLaw(reduced)))
    inputs = {name: value for name, value in estimate.values.items() if name not in RIGIDITIES}

    def predict(log_rigidities: Floats) -> Floats:
        values = inputs | dict(zip(RIGIDITIES, np.exp(log_rigidities).T, strict=True))
        return np.concatenate([model.log_frequencies(values, "exact") for model in models], axis=1)

    return predict


@cache
def control_of(setting: Setting) -> NullControl:
    """Null simulations of a setting: the same for every board of it, whichever process makes them."""
    planted = _median_board(setting)
    ground = ground_of(planted, shared_law)
    return force_choices(ground, null_control(ground, setting.rng()))


@cache
def _laws(design: str) -> Mapping[str, FormLaw]:
    """By the form's title."""
    baseline = median_baseline(design)
    every = [form for each in forms(baseline.board).values() for form in each]
    return {form.title: form_law(baseline, form, HALF_WIDTH) for form in every}


@cache
def _bare_models(design: str) -> tuple[SetupModel, ...]:
    """Exact laws of the setups without any effect."""
    board, estimate = _fitted(_median_board(_plain(design)))
    parameters = Parameters(board)
    centre = parameters.theta(dict(estimate.values), np.array([setup.noise.median for setup in board.setups]))
    covariance = np.eye(parameters.n_dim)
    n = parameters.n_constants
    covariance[:n, :n] = np.diag([HALF_WIDTH**2 / 9.0] * (n - 1) + [0.0])
    return exact_models(board, estimate.models, centre, covariance)


def median_baseline(design: str) -> Baseline:
    """The noiseless board of a design's median constants, fitted."""
    return baseline_of_card(_median_board(_plain(design)))


def _plain(design: str) -> Setting:
    return Setting(design, 0.0, UNKNOWN, 0.0)


def _median_board(setting: Setting) -> PlantedBoard:
    """The board of the median constants, without noise; its card states the noise of the setting."""
    planted = plant(
        np.random.default_rng(0),
        setting.design,
        (),
        noise_cents=0.0,
        sensor=SENSORS[setting.design],
        noise_factor=setting.noise_factor,
        resolution=setting.resolution,
        constants={name: value for name, (value, _) in MEDIANS.items()},
    )
    return replace(planted, truth=replace(planted.truth, noise_cents=setting.noise_cents))


def _fitted(planted: PlantedBoard) -> tuple[Board, Estimate]:
    with tempfile.TemporaryDirectory() as folder:
        card = Path(folder, f"{planted.name}.toml")
        card.write_text(planted.card_text({"kind": f'"{KINDS[planted.design.name]}"'}))
        board = prepare(card).board
    return board, weighted_least_squares(board)
