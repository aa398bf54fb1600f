"""What results are made of: one value per elastic constant, spread and joint spread of draws, the one way to JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.posterior.draws import Draws

Held = TypeVar("Held")

NOT_IN_JSON = {"in_json": False}
"""Metadata of a field that `as_json` leaves out."""

_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class ByConstant(Mapping[str, Held]):
    """One value per constant, by attribute or by name as in a dict: `elastic.E_x` is `elastic["E_x"]`."""

    NAMES: ClassVar[tuple[str, ...]] = ()

    def __getitem__(self, name: str) -> Held:
        if name not in self.NAMES:
            raise KeyError(name)
        held: Held = getattr(self, name)
        return held

    def __iter__(self) -> Iterator[str]:
        return iter(self.NAMES)

    def __len__(self) -> int:
        return len(self.NAMES)


@dataclass(frozen=True)
class Elastic(ByConstant[Held]):
    """One value per elastic modulus."""

    E_x: Held
    E_y: Held
    G_xy: Held
    NAMES: ClassVar[tuple[str, ...]] = MODULI


@dataclass(frozen=True)
class Rigidity(ByConstant[Held]):
    """One value per rigidity."""

    D_x: Held
    D_y: Held
    D_s: Held
    NAMES: ClassVar[tuple[str, ...]] = RIGIDITIES


@dataclass(frozen=True)
class Constants(ByConstant[Held]):
    """One value per modulus (Pa) and per rigidity (N m)."""

    E_x: Held
    E_y: Held
    G_xy: Held
    D_x: Held
    D_y: Held
    D_s: Held
    NAMES: ClassVar[tuple[str, ...]] = MODULI + RIGIDITIES


@dataclass(frozen=True)
class Spread:
    """Mean, standard deviation and quantiles of draws, in a unit."""

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
        """Those of draws, in an array of any shape.

        An exact value is the same in every draw. It has no spread, but the rounding of a mean would give it one, and a
        number is written with as many digits as its spread has meaning.
        """
        if np.all(values == values.flat[0]):
            exact = float(values.flat[0])
            return cls(exact, 0.0, exact, exact, exact, exact, exact, unit)
        q05, q25, q50, q75, q95 = (float(value) for value in np.quantile(values, _QUANTILES))
        return cls(float(np.mean(values)), float(np.std(values, ddof=1)), q05, q25, q50, q75, q95, unit)


def as_json(value: Any) -> Any:
    """A result as JSON has it: the fields of a dataclass by name and in their order, tuples as lists."""
    if is_dataclass(value):
        written = (one.name for one in fields(value) if one.metadata != NOT_IN_JSON)
        return {name: as_json(getattr(value, name)) for name in written}
    if isinstance(value, Mapping):
        return {key: as_json(one) for key, one in value.items()}
    if isinstance(value, tuple | list):
        return [as_json(one) for one in value]
    return value


def json_text(content: Any) -> str:
    """JSON of a result, as it is written and printed; refuses numbers that JSON does not have."""
    return json.dumps(as_json(content), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def finite(value: float) -> float | None:
    """The number, or None where JSON has none: infinity and not-a-number."""
    return float(value) if np.isfinite(value) else None


def rms(values: Sequence[float | None] | NDArray[np.float64]) -> float | None:
    """Root of the mean square of those that are numbers; None if none is."""
    numbers = np.array(values, dtype=float)
    numbers = numbers[np.isfinite(numbers)]
    return float(np.sqrt(np.mean(numbers**2))) if numbers.size else None


JOINT = (*MODULI, *RIGIDITIES, "density")
"""Whatever makers compute is a product of powers of these, so that its logarithm is a sum of theirs."""


@dataclass(frozen=True)
class Joint:
    """Natural logarithms of constants and density together, in SI units."""

    names: tuple[str, ...]  # E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m), density (kg m^-3)
    log_mean: tuple[float, ...]  # in that order
    log_covariance: tuple[tuple[float, ...], ...]  # row after row

    @classmethod
    def of(cls, draws: Draws) -> Joint:
        """That of draws."""
        return cls.of_values({**draws.moduli, **draws.rigidities, "density": draws.derived["density"].values})

    @classmethod
    def of_values(cls, values: Mapping[str, NDArray[np.float64]]) -> Joint:
        """That of draws by name, each an array of the same shape, SI."""
        logs = np.stack([np.log(np.ravel(values[name])) for name in JOINT])
        mean = logs.mean(axis=1)
        apart = logs - mean[:, None]
        covariance = (apart[:, None] * apart[None]).sum(axis=2) / (logs.shape[1] - 1)
        return cls(
            JOINT, tuple(float(one) for one in mean), tuple(tuple(float(one) for one in row) for row in covariance)
        )
