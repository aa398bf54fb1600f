"""Parts of results: one value per elastic constant, spread and joint moments of draws, conversion to JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.posterior.draws import Draws

ConstantValue = TypeVar("ConstantValue")

NOT_IN_JSON = {"in_json": False}
"""Metadata of a field that `as_json` leaves out."""

_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class ByConstant(Mapping[str, ConstantValue]):
    """One value per constant, by attribute or by name as in a dict: `elastic.E_x` is `elastic["E_x"]`."""

    NAMES: ClassVar[tuple[str, ...]] = ()

    def __getitem__(self, name: str) -> ConstantValue:
        if name not in self.NAMES:
            raise KeyError(name)
        value: ConstantValue = getattr(self, name)
        return value

    def __iter__(self) -> Iterator[str]:
        return iter(self.NAMES)

    def __len__(self) -> int:
        return len(self.NAMES)


@dataclass(frozen=True)
class Elastic(ByConstant[ConstantValue]):
    """One value per elastic modulus."""

    E_x: ConstantValue
    E_y: ConstantValue
    G_xy: ConstantValue
    NAMES: ClassVar[tuple[str, ...]] = MODULI


@dataclass(frozen=True)
class Rigidity(ByConstant[ConstantValue]):
    """One value per rigidity."""

    D_x: ConstantValue
    D_y: ConstantValue
    D_s: ConstantValue
    NAMES: ClassVar[tuple[str, ...]] = RIGIDITIES


@dataclass(frozen=True)
class Constants(ByConstant[ConstantValue]):
    """One value per modulus (Pa) and per rigidity (N m)."""

    E_x: ConstantValue
    E_y: ConstantValue
    G_xy: ConstantValue
    D_x: ConstantValue
    D_y: ConstantValue
    D_s: ConstantValue
    NAMES: ClassVar[tuple[str, ...]] = MODULI + RIGIDITIES


@dataclass(frozen=True)
class Spread:
    """Mean, standard deviation and quantiles of draws, with their unit."""

    mean: float
    sd: float
    q05: float
    q25: float
    q50: float
    q75: float
    q95: float
    unit: str

    @classmethod
    def of(cls, values: NDArray[np.float64], unit: str) -> Spread:
        """The spread of draws, in an array of any shape.

        An exact value is the same in every draw. Its spread is set to zero, which the rounding of the mean would miss:
        the spread decides with how many digits a number is printed.
        """
        if np.all(values == values.flat[0]):
            exact = float(values.flat[0])
            return cls(exact, 0.0, exact, exact, exact, exact, exact, unit)
        q05, q25, q50, q75, q95 = (float(value) for value in np.quantile(values, _QUANTILES))
        return cls(float(np.mean(values)), float(np.std(values, ddof=1)), q05, q25, q50, q75, q95, unit)


def as_json(value: Any) -> Any:
    """A result as JSON content: the fields of a dataclass by name and in their order, tuples as lists."""
    if is_dataclass(value):
        names = (field.name for field in fields(value) if field.metadata != NOT_IN_JSON)
        return {name: as_json(getattr(value, name)) for name in names}
    if isinstance(value, Mapping):
        return {key: as_json(entry) for key, entry in value.items()}
    if isinstance(value, tuple | list):
        return [as_json(entry) for entry in value]
    return value


def json_text(content: Any) -> str:
    """JSON of a result, as it is written and printed; refuses infinity and not-a-number."""
    return json.dumps(as_json(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def finite_or_none(value: float) -> float | None:
    """The number; None, as JSON needs it, for infinity and not-a-number."""
    return float(value) if np.isfinite(value) else None


def rms(values: Sequence[float | None] | NDArray[np.float64]) -> float | None:
    """Root mean square of the finite values; None if there are none."""
    numbers = np.array(values, dtype=float)
    numbers = numbers[np.isfinite(numbers)]
    return float(np.sqrt(np.mean(numbers**2))) if numbers.size else None


JOINT_NAMES = (*MODULI, *RIGIDITIES, "density")
"""Quantities of `JointMoments`; every maker's figure is a product of their powers, its logarithm linear in theirs."""


@dataclass(frozen=True)
class JointMoments:
    """Mean and covariance of the natural logarithms of constants and density, SI units."""

    names: tuple[str, ...]  # E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m), density (kg m^-3)
    log_mean: tuple[float, ...]  # in that order
    log_covariance: tuple[tuple[float, ...], ...]  # row after row

    @classmethod
    def of(cls, draws: Draws) -> JointMoments:
        """The moments of the draws of a fit."""
        return cls.of_values({**draws.moduli, **draws.rigidities, "density": draws.derived["density"].values})

    @classmethod
    def of_values(cls, values: Mapping[str, NDArray[np.float64]]) -> JointMoments:
        """The moments of draws by name, each an array of the same shape, SI."""
        logs = np.stack([np.log(np.ravel(values[name])) for name in JOINT_NAMES])
        mean = logs.mean(axis=1)
        deviations = logs - mean[:, None]
        covariance = (deviations[:, None] * deviations[None]).sum(axis=2) / (logs.shape[1] - 1)
        return cls(
            JOINT_NAMES,
            tuple(float(entry) for entry in mean),
            tuple(tuple(float(entry) for entry in row) for row in covariance),
        )
