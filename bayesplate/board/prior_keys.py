"""The keys of a prior card that hold a quantity and its source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from bayesplate.board.measures import DENSITY, POISSON, QuantityReader, read_factor, read_noise_percent, written_noise
from bayesplate.board.quantity import Quantity
from bayesplate.board.units import in_unit, median_and_factor
from bayesplate.board.values import Choice, Complaint, Key, Number, Refusal, read_table, read_text
from bayesplate.board.words import shown


@dataclass(frozen=True)
class StatedPrior:
    """A prior of a card, in SI units or percent, and the source it was taken from."""

    quantity: Quantity
    source: str


_DISTRIBUTIONS = ("log-normal", "log-uniform")


@dataclass(frozen=True)
class _Constant:
    """Reads { distribution, median_gpa, factor, source } or { distribution, lower_gpa, upper_gpa, source }."""

    unit: Literal["gpa", "n_m"]

    @property
    def number(self) -> Number:
        """What may stand in such a key."""
        return Number(1e-6, 1e6, "GPa") if self.unit == "gpa" else Number(1e-9, 1e9, "N m")

    def read(self, value: object) -> StatedPrior:
        if not isinstance(value, dict):
            raise Refusal(Complaint("a table with a distribution", shown(value)))
        if value.get("distribution") not in _DISTRIBUTIONS:
            read_table({"distribution": value.get("distribution")}, {"distribution": Choice(_DISTRIBUTIONS)})
        number, si = self.number, self.number.si
        median, lower, upper = (f"{key}_{self.unit}" for key in ("median", "lower", "upper"))
        readers: dict[str, Any] = {"distribution": Choice(_DISTRIBUTIONS), "source": read_text}
        if value["distribution"] == "log-normal":
            readers |= {median: number, "factor": read_factor}
            read = read_table(value, readers, needed=readers)
            return StatedPrior(Quantity.from_median(read[median] * si, read["factor"]), read["source"])
        readers |= {lower: number, upper: number}
        read = read_table(value, readers, needed=readers)
        if not read[lower] < read[upper]:
            both = f"{shown(value[lower])} and {shown(value[upper])}"
            raise Refusal(Complaint(f"{lower} below {upper}", both))
        return StatedPrior(Quantity.from_range(read[lower] * si, read[upper] * si), read["source"])

    def write(self, stated: StatedPrior) -> dict[str, Any]:
        one, si = stated.quantity, self.number.si
        if one.kind == "log-uniform":
            numbers = {f"lower_{self.unit}": in_unit(one.lower, si), f"upper_{self.unit}": in_unit(one.upper, si)}
        else:
            median, factor = median_and_factor(one, si, lambda m, f: Quantity.from_median(m * si, f))
            numbers = {f"median_{self.unit}": median, "factor": factor}
        return {"distribution": one.kind, **numbers, "source": stated.source}


def _with_source(read: Callable[[Any], Quantity], write: Callable[[Quantity], dict[str, Any]]) -> Key:
    """A key that holds a quantity in a table with its source."""

    def read_both(value: object) -> StatedPrior:
        if not isinstance(value, dict):
            raise Refusal(Complaint("a table with a source", shown(value)))
        if "source" not in value:
            raise Refusal(Complaint("where the numbers come from", "nothing", inside=("source",)))
        quantity = read({key: entry for key, entry in value.items() if key != "source"})
        return StatedPrior(quantity, read_text(value["source"]))

    return Key(read_both, lambda stated: write(stated.quantity) | {"source": stated.source})


_ELASTIC, _RIGIDITY = (Key(one.read, one.write) for one in (_Constant("gpa"), _Constant("n_m")))
_READER = QuantityReader(DENSITY)
ElasticPrior = Annotated[StatedPrior | None, _ELASTIC]
RigidityPrior = Annotated[StatedPrior | None, _RIGIDITY]
NoisePrior = Annotated[StatedPrior | None, _with_source(read_noise_percent, lambda one: written_noise(one, 1.0))]
PoissonPrior = Annotated[StatedPrior | None, _with_source(POISSON.read, POISSON.write)]
DensityPrior = Annotated[StatedPrior | None, _with_source(_READER, _READER.written)]
