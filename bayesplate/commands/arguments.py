"""Arguments of the public functions, read as their annotations say: every fault at once, before any work."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, wraps
from numbers import Integral, Real
from typing import Any, ParamSpec, TypeGuard, TypeVar, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from bayesplate.board.board import Board
from bayesplate.board.campaign import CampaignCard
from bayesplate.board.prior import PriorCard
from bayesplate.board.values import Complaint, Key, Refusal
from bayesplate.board.words import (
    EFFECT_NAMES,
    OTHER_EFFECT_NAMES,
    canonical_effect,
    did_you_mean,
    quote_text,
    show_value,
)
from bayesplate.commands.prepare import PreparedBoard
from bayesplate.errors import Fault, InputError

P = ParamSpec("P")
R = TypeVar("R")
Reader = Callable[[Any], Any]
"""Reads the value of an argument from what was given; raises Refusal."""
Rule = Callable[[Mapping[str, Any]], Iterable[Fault]]
"""Faults of arguments that contradict one another, from those that were given, by name."""


def check_arguments(*rules: Rule) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """A decorator: arguments are read by the `Key` of their annotations, and linear algebra runs in one thread.

    Several threads would only wait for one another, for the matrices are small and many. A call raises
    InputError with every argument that cannot be used, and with those that contradict each other by a rule.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)

        @wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            import scipy.linalg  # noqa: F401  (what is not loaded is not limited)
            from threadpoolctl import threadpool_limits

            bound = signature.bind(*args, **kwargs)
            with threadpool_limits(1, user_api="blas"):
                bound.arguments |= read_arguments(function, bound.arguments, (contradictions, *rules))
                return function(*bound.args, **bound.kwargs)

        return call

    return decorate


def read_arguments(
    function: Callable[..., Any], arguments: Mapping[str, Any], rules: Iterable[Rule] = ()
) -> dict[str, Any]:
    """Read the arguments of a function, by name; raises InputError with every fault."""
    model, faults = _argument_model(function), list[Fault]()
    values = {}
    try:
        values = dict(model.model_validate({name: arguments[name] for name in model.model_fields if name in arguments}))
    except ValidationError as invalid:
        for detail in invalid.errors(include_url=False):
            error = detail["ctx"]["error"]
            is_refusal = isinstance(error, Refusal)  # otherwise what numpy or Python say of a value
            complaints = error.complaints if is_refusal else (Complaint("a plain value", show_value(detail["input"])),)
            faults += [
                Fault(
                    _argument_place(*detail["loc"], *complaint.path),
                    complaint.wanted,
                    complaint.got,
                    complaint.remedy,
                )
                for complaint in complaints
            ]
    faults += [fault for rule in rules for fault in rule(arguments)]
    if faults:
        raise InputError(faults)
    return {name: value for name, value in values.items() if name in arguments}


def annotations_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Annotations of the parameters, with what they hold besides types."""
    return get_type_hints(inspect.unwrap(function), include_extras=True)


@cache
def _argument_model(function: Callable[..., Any]) -> type[BaseModel]:
    fields: dict[str, Any] = {
        name: (annotation, None)
        for name, annotation in annotations_of(function).items()
        if any(isinstance(entry, Key) for entry in getattr(annotation, "__metadata__", ()))
    }
    return create_model("Arguments", __config__=ConfigDict(arbitrary_types_allowed=True), **fields)


def _argument_place(*location: object) -> str:
    return " ".join(str(step + 1 if isinstance(step, int) else step) for step in location)


def contradictions(arguments: Mapping[str, Any]) -> Iterator[Fault]:
    """Arguments that exclude each other, or lack one another."""
    if arguments.get("force") is True and arguments.get("resume") is True:
        yield Fault("force and resume", "one of them", "both", "force starts anew and resume continues")
    if arguments.get("resume") is True and arguments.get("out") is None:
        yield Fault("resume", "the folder of the run that is continued, as out", "no out")
    if arguments.get("workers") and arguments.get("dask"):
        yield Fault("workers and dask", "one of them", "both", "workers are processes here, dask others")


def refusal_of(wanted: str, value: object, remedy: str = "") -> Refusal:
    """The refusal of an argument, to be raised."""
    return Refusal(Complaint(wanted, value_text(value), remedy))


def value_text(value: object) -> str:
    """A value as Python writes it."""
    return repr(value) if value is None or isinstance(value, bool | tuple) else show_value(value)


def optional_reader(read: Reader) -> Reader:
    return lambda value: None if value is None else read(value)


def instance_reader(kind: type) -> Reader:
    """A reader of instances of a class."""

    def read(value: object) -> object:
        if not isinstance(value, kind):
            raise refusal_of(f"a {kind.__name__}", value)
        return value

    return read


def read_path(value: object, wanted: str = "a name or a path") -> Any:
    """A name or a path, as it is."""
    if not isinstance(value, str | os.PathLike):
        raise refusal_of(wanted, value)
    if not os.fspath(value):
        raise Refusal(Complaint(wanted, "an empty text"))
    if "\0" in str(value):
        raise refusal_of(wanted, str(value))
    return value


def read_card(value: object) -> object:
    """A name or a path, a Board, or a Problem or Campaign."""
    is_problem = isinstance(getattr(value, "prepared", None), PreparedBoard) or isinstance(
        getattr(value, "card", None), CampaignCard
    )
    return value if is_problem or isinstance(value, Board) else read_path(value, "a name, a path, a Board or a Problem")


def read_prior(value: object) -> object:
    return value if isinstance(value, PriorCard) else read_path(value, "a name, a path or a PriorCard")


LARGEST_INTEGER = 2**63 - 1
"""Largest whole number that the files of a run hold."""


def integer_reader(least: int) -> Reader:
    """A reader of whole numbers."""

    def read(value: object) -> int:
        if isinstance(value, bool | np.bool_) or not isinstance(value, Integral) or value < least:
            raise refusal_of(f"a whole number from {least} on", value)
        if int(value) > LARGEST_INTEGER:
            raise refusal_of("a whole number below 2^63", value)
        return int(value)

    return read


def read_bool(value: object) -> bool:
    """True or False alone."""
    if not isinstance(value, bool):
        raise refusal_of("True or False", value)
    return value


def word_reader(*words: str | None) -> Reader:
    """A reader of one word of several, of which the last may be None."""
    *first, last = (quote_text(word) if word else "None" for word in words)

    def read(value: object) -> object:
        if not isinstance(value, str | None) or value not in words:
            hint = did_you_mean(value, [word for word in words if word]) if isinstance(value, str) else ""
            raise refusal_of(f"{', '.join(first)} or {last}", value, hint)
        return value

    return read


def read_function(value: object) -> object:
    if value is not None and not callable(value):
        raise refusal_of("a function or None", value)
    return value


def effects_reader(name: str) -> Reader:
    """A reader of different names of effects, for the argument of that name, or of None."""

    def read(value: object) -> list[str] | None:
        if value is None:
            return None
        if not isinstance(value, list | tuple):
            remedy = f'{name}=["{value}"]' if value in (*EFFECT_NAMES, *OTHER_EFFECT_NAMES) else ""
            raise refusal_of("a list of names of effects", value, remedy)
        effects = [canonical_effect(item) if isinstance(item, str) else item for item in value]
        complaints = []
        for index, effect in enumerate(effects):
            if effect not in EFFECT_NAMES:
                hint = did_you_mean(effect, EFFECT_NAMES) if isinstance(effect, str) else ""
                complaints += refusal_of(f"one of {', '.join(EFFECT_NAMES)}", effect, hint).complaints_below(index)
            elif effect in effects[:index]:
                complaints += Refusal(Complaint("each name once", f"{quote_text(effect)} again")).complaints_below(
                    index
                )
        if complaints:
            raise Refusal(*complaints)
        return effects

    return read


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a finite number, and no truth value."""
    is_truth = isinstance(value, bool | np.bool_)
    return not is_truth and isinstance(value, Real) and math.isfinite(float(value))


def is_positive(value: object) -> TypeGuard[float]:
    return is_number(value) and value > 0.0
