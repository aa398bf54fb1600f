"""The keys of a prior card that hold a quantity and its source."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from bayesplate.board.measures import DENSITY, POISSON, QuantityReader, read_factor, read_noise_percent, write_noise
from bayesplate.board.quantity import Quantity
from bayesplate.board.units import in_unit, median_and_factor
from bayesplate.board.values import Choice, Complaint, Key, Number, Refusal, read_entries, read_text
from bayesplate.board.words import show_value


@dataclass(frozen=True)
class StatedPrior:
    """A prior of a card, in SI units or percent, and the source it was taken from."""

    quantity: Quantity
    source: str


_DISTRIBUTIONS = ("log-normal", "log-uniform")


@dataclass(frozen=True)
class _ConstantReader:
    """Reads { distribution, median_gpa, factor, source } or { distribution, lower_gpa, upper_gpa, source }."""

    unit: Literal["gpa", "n_m"]

    @property
    def number(self) -> Number:
        """The number that the key takes."""
        return Number(1e-6, 1e6, "GPa") if self.unit == "gpa" else Number(1e-9, 1e9, "N m")

    def read(self, value: object) -> StatedPrior:
        if not isinstance(value, dict):
            raise Refusal(Complaint("a table with a distribution", show_value(value)))
        if value.get("distribution") not in _DISTRIBUTIONS:
            read_entries({"distribution": value.get("distribution")}, {"distribution": Choice(_DISTRIBUTIONS)})
        number, si = self.number, self.number.si
        median, lower, upper = (f"{key}_{self.unit}" for key in ("median", "lower", "upper"))
        readers: dict[str, Any] = {"distribution": Choice(_DISTRIBUTIONS), "source": read_text}
        if value["distribution"] == "log-normal":
            readers |= {median: number, "factor": read_factor}
            entries = read_entries(value, readers, needed=readers)
            return StatedPrior(Quantity.from_median(entries[median] * si, entries["factor"]), entries["source"])
        readers |= {lower: number, upper: number}
        entries = read_entries(value, readers, needed=readers)
        if not entries[lower] < entries[upper]:
            got = f"{show_value(value[lower])} and {show_value(value[upper])}"
            raise Refusal(Complaint(f"{lower} below {upper}", got))
        return StatedPrior(Quantity.from_range(entries[lower] * si, entries[upper] * si), entries["source"])

    def write(self, stated: StatedPrior) -> dict[str, Any]:
        quantity, si = stated.quantity, self.number.si
        if quantity.kind == "log-uniform":
            numbers = {
                f"lower_{self.unit}": in_unit(quantity.lower, si),
                f"upper_{self.unit}": in_unit(quantity.upper, si),
            }
        else:
            median, factor = median_and_factor(quantity, si, lambda m, f: Quantity.from_median(m * si, f))
            numbers = {f"median_{self.unit}": median, "factor": factor}
        return {"distribution": quantity.kind, **numbers, "source": stated.source}


def _sourced_key(read: Callable[[Any], Quantity], write: Callable[[Quantity], Any]) -> Key:
    """A key that holds a quantity in a table with its source."""

    def read_with_source(value: object) -> StatedPrior:
        if not isinstance(value, dict):
            raise Refusal(Complaint("a table with a source", show_value(value)))
        if "source" not in value:
            raise Refusal(Complaint("where the numbers come from", "nothing", path=("source",)))
        quantity = read({key: entry for key, entry in value.items() if key != "source"})
        return StatedPrior(quantity, read_text(value["source"]))

    def write_with_source(stated: StatedPrior) -> dict[str, Any]:
        written = write(stated.quantity)
        return (written if isinstance(written, dict) else {"readings": written}) | {"source": stated.source}

    return Key(read_with_source, write_with_source)


_ELASTIC_KEY, _RIGIDITY_KEY = (
    Key(reader.read, reader.write) for reader in (_ConstantReader("gpa"), _ConstantReader("n_m"))
)
_DENSITY_READER = QuantityReader(DENSITY)
ElasticPrior = Annotated[StatedPrior | None, _ELASTIC_KEY]
RigidityPrior = Annotated[StatedPrior | None, _RIGIDITY_KEY]
NoisePrior = Annotated[StatedPrior | None, _sourced_key(read_noise_percent, lambda noise: write_noise(noise, 1.0))]
PoissonPrior = Annotated[StatedPrior | None, _sourced_key(POISSON.read, POISSON.write)]
DensityPrior = Annotated[StatedPrior | None, _sourced_key(_DENSITY_READER, _DENSITY_READER.write)]
