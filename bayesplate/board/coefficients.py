"""The coefficient table: the paper's a, b, c of each mode, for one shape of board and one way to hold its edges."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from bayesplate.board.measures import FIRST_LABEL, LARGEST_POISSON, table_by_label
from bayesplate.board.reading import NO_OFFSET
from bayesplate.board.schema import BaseCard, Section, validate_card
from bayesplate.board.setup_keys import Edges
from bayesplate.board.shelf import CardFile
from bayesplate.board.values import Complaint, Key, Number, Refusal, Text, read_entries, read_items, read_list
from bayesplate.board.words import show_value
from bayesplate.labels import Label

CoefficientTriple = tuple[float, float, float]
_COEFFICIENT = Number(-1e9, 1e9)
_SIDE = Number(1e-3, 1e5)
_Modulus = Annotated[float | None, Key(Number(1e-4, 1000, "GPa"))]
_PoissonRatio = Annotated[float | None, Key(Number(-LARGEST_POISSON, LARGEST_POISSON))]
_SideLength = Annotated[float | None, Key(Number(1, 100_000, "mm"))]


def _read_aspect(value: object) -> float:
    """L_x / L_y: a number, or the two lengths [223, 114]."""
    if isinstance(value, list) and len(value) == 2:
        length, width = read_items(enumerate(value), _SIDE)
        return length / width
    if isinstance(value, list):
        raise Refusal(Complaint("two numbers, [L_x, L_y]", show_value(value)))
    return Number(1e-3, 1e3)(value)


@dataclass(frozen=True)
class _CoefficientRow:
    a: float
    b: float
    c: float
    r_squared: float | None = None


def _read_row(value: object) -> _CoefficientRow:
    """One mode: { a, b, c, r_squared }."""
    if not isinstance(value, dict):
        raise Refusal(Complaint("{ a, b, c, r_squared }", show_value(value)))
    readers = {"a": _COEFFICIENT, "b": _COEFFICIENT, "c": _COEFFICIENT, "r_squared": Number(0, 1)}
    return _CoefficientRow(**read_entries(value, readers, needed=("a", "b", "c")))


_ROWS_KEY = table_by_label(Key(_read_row))


def _read_rows(value: object) -> dict[Label, _CoefficientRow]:
    rows: dict[Label, _CoefficientRow] = _ROWS_KEY.read(value)
    if not rows:
        raise Refusal(Complaint('a row for each mode, "(1,0)" = { a, b, c }', "no modes"))
    return rows


def _read_steps(value: object) -> tuple[float, ...]:
    return tuple(read_items(enumerate(read_list(value, "factors", 100)), Number(0.01, 100)))


class TrainingSection(Section):
    """The plates whose frequencies were fitted: dimensions in mm, moduli in GPa, density in kg/m3."""

    length_x_mm: _SideLength = None
    length_y_mm: _SideLength = None
    thickness_mm: Annotated[float | None, Key(Number(0.01, 1000, "mm"))] = None
    density_kg_m3: Annotated[float | None, Key(Number(1, 30_000, "kg/m3"))] = None
    E_x_gpa: _Modulus = None
    E_y_gpa: _Modulus = None
    E_z_gpa: _Modulus = None
    G_xy_gpa: _Modulus = None
    G_xz_gpa: _Modulus = None
    G_yz_gpa: _Modulus = None
    nu_xy: _PoissonRatio = None
    nu_xz: _PoissonRatio = None
    nu_yz: _PoissonRatio = None
    steps: Annotated[tuple[float, ...], Key(_read_steps)] = ()


class CoefficientCard(BaseCard):
    """A printed or computed table of a, b, c. `load_coefficients` makes one."""

    source: Text = Field(description="where the numbers come from")
    aspect_ratio: Annotated[float, Key(_read_aspect)] = Field(description="[L_x, L_y] or their ratio")
    first_label: Annotated[Label, FIRST_LABEL] = NO_OFFSET
    edges: Edges = Field(description="how the four edges are held")
    training: TrainingSection = TrainingSection()
    rows: Annotated[Mapping[Label, _CoefficientRow], Key(_read_rows)] = Field(
        alias="coefficients", description='a row for each mode, "(1,0)" = { a, b, c }'
    )

    @property
    def table(self) -> dict[Label, CoefficientTriple]:
        """Label to (a, b, c), no unit: omega_bar^2 = a p + b q + c."""
        return {label: (row.a, row.b, row.c) for label, row in self.rows.items()}

    @property
    def r_squared(self) -> dict[Label, float]:
        """Label to the coefficient of determination of the fit, where the table states one."""
        return {label: row.r_squared for label, row in self.rows.items() if row.r_squared is not None}


def load_coefficients(name_or_path: str | os.PathLike[str], folder: Path | None = None) -> CoefficientCard:
    """Read a coefficient table, shipped or a path from `folder`; InputError names every fault at once."""
    return validate_card(CoefficientCard, CardFile.load("coefficients", name_or_path, folder))
