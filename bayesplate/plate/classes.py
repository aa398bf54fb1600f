"""One symmetry class of a plate: its unknowns, its matrices, and every term on given vectors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Bools, Floats, Indices
from bayesplate.plate.beams import is_rigid
from bayesplate.plate.forms import Elements, Forms, each_weighed
from bayesplate.plate.terms import (
    AlongEdges,
    Amount,
    AtPlaces,
    Deflections,
    OnDeflections,
    OverPlate,
    Parity,
    Term,
    Weights,
)


@dataclass(frozen=True, eq=False)
class SymmetryClass:
    """One symmetry class of a plate: its unknowns, and the plate's terms on them."""

    plate: Forms
    parity: Parity

    @cached_property
    def _numbering(self) -> tuple[dict[str, Indices], int]:
        """Number of each field's unknown by its functions along x and along y, -1 where there is none; how many."""
        x, y = self.plate.x, self.plate.y
        is_sheared = len(self.plate.kinematics.fields) > 1
        along_x, along_y = x.kept(self.parity.x, is_sheared), y.kept(self.parity.y, is_sheared)
        kept = {"w": np.outer(along_x, along_y)}
        if is_sheared:
            kept["g_x"] = np.outer(x.kept_strain(self.parity.x), along_y)
            kept["g_y"] = np.outer(along_x, y.kept_strain(self.parity.y))
        numbers, n = {}, 0
        for name, own in kept.items():
            numbers[name] = np.where(own, n - 1 + np.cumsum(own).reshape(own.shape), -1)
            n += int(own.sum())
        if is_sheared:  # at a clamp the cross-section does not turn: the strain there is the slope of the deflection
            for value, slope in x.ties():
                numbers["g_x"][value] = numbers["w"][slope]
            for value, slope in y.ties():
                numbers["g_y"][:, value] = numbers["w"][:, slope]
        return numbers, n

    @property
    def n_on_plate(self) -> int:
        """Number of unknowns of the plate itself; the coordinates beside it come after them."""
        return self._numbering[1]

    @property
    def n_dof(self) -> int:
        return self.n_on_plate + self.plate.n_beside

    @cached_property
    def n_rigid(self) -> int:
        """Number of rigid motions of the whole plate in this class."""
        ends = self.plate.x.ends, self.plate.y.ends
        return sum(is_rigid(one, *ends) and self.plate.parity(one) == self.parity for one in np.ndindex(2, 2))

    def pencil(self, elements: tuple[Elements, Elements]) -> tuple[Any, Any]:
        """Sparse (n_dof, n_dof) stiffness and mass from the plate's elements."""
        stiffness, mass = (self._assembled(one) for one in elements)
        return stiffness, mass

    def _assembled(self, elements: Elements) -> Any:
        from scipy.sparse import csc_array

        kept, stored_at, indices, indptr = self._pattern
        values = np.concatenate([self._values(elements, both) for both in self._field_pairs])
        stored = np.bincount(stored_at, values[kept], indices.size)
        matrix = csc_array((stored, indices, indptr), shape=(self.n_dof, self.n_dof))
        if not elements.elsewhere:
            return matrix
        left, right, at = self._stacked
        scales = np.concatenate([weight * self._rows[term][2] for term, weight in elements.elsewhere])
        rows = np.concatenate([at[term] for term, _ in elements.elsewhere])[scales != 0.0]
        form = left[rows].T @ (right[rows] * scales[scales != 0.0][:, None])
        return csc_array(matrix + 0.5 * (form + form.T))

    @cached_property
    def _stacked(self) -> tuple[Any, Any, dict[Term, Indices]]:
        """What is multiplied by all terms of `_rows` together, sparse: (n, n_dof) arrays, and the rows of each term."""
        from scipy.sparse import csr_array

        left, right = (csr_array(np.concatenate([rows[i] for rows in self._rows.values()])) for i in (0, 1))
        ends = np.cumsum([shares.size for _, _, shares in self._rows.values()])
        at = (np.arange(end - shares.size, end) for end, (_, _, shares) in zip(ends, self._rows.values(), strict=True))
        return left, right, dict(zip(self._rows, at, strict=True))

    @property
    def _field_pairs(self) -> list[tuple[str, str]]:
        return list(combinations_with_replacement(self.plate.kinematics.fields, 2))

    def _values(self, elements: Elements, both: tuple[str, str]) -> Floats:
        """Entries of a block of two fields, and of the mirrored one where they differ."""
        local = elements.over_plate.get(both)
        if local is None:
            n_elements = len(self.plate.x.unknowns) * len(self.plate.y.unknowns)
            local = np.zeros((n_elements, 16, 16))
        return local.ravel() if both[0] == both[1] else np.concatenate([local.ravel(), local.swapaxes(1, 2).ravel()])

    @cached_property
    def _pattern(self) -> tuple[Bools, Indices, NDArray[np.int32], NDArray[np.int32]]:
        """Which entries of the elements count, where each is stored, and the rows and column starts of these places."""
        own = {name: self._of_elements(name) for name in self.plate.kinematics.fields}
        rows, columns = [], []
        for first, second in self._field_pairs:
            for a, b in dict.fromkeys(((first, second), (second, first))):
                pair = np.broadcast_arrays(own[a][:, :, None], own[b][:, None, :])
                rows.append(pair[0].ravel())
                columns.append(pair[1].ravel())
        row, column = np.concatenate(rows), np.concatenate(columns)
        kept = (row >= 0) & (column >= 0)
        places, stored_at = np.unique(column[kept] * self.n_dof + row[kept], return_inverse=True)
        indptr = np.searchsorted(places, np.arange(self.n_dof + 1) * self.n_dof)
        return kept, stored_at, (places % self.n_dof).astype(np.int32), indptr.astype(np.int32)

    def _of_elements(self, name: str) -> Indices:
        """Number of each element's unknowns of a field, in the order of `Plate.elements`: (n_elements, 16) array."""
        x, y = self.plate.x.unknowns, self.plate.y.unknowns
        found = self._numbering[0][name][x[None, :, :, None], y[:, None, None, :]]
        return found.reshape(len(x) * len(y), 16)

    @cached_property
    def _rows(self) -> dict[Term, tuple[Floats, Floats, Floats]]:
        """For each term along edges or at places what is multiplied: (n, n_dof) arrays and their (n,) shares."""
        terms = (term for term, _ in (*self.plate.stiffness, *self.plate.masses))
        return {
            term: self._along_edges(term) if isinstance(term, AlongEdges) else self._at_places(term)
            for term in terms
            if isinstance(term, AlongEdges | AtPlaces)
        }

    def _along_edges(self, term: AlongEdges) -> tuple[Floats, Floats, Floats]:
        x, y = self.plate.x, self.plate.y
        total: Floats | float = 0.0
        shares = np.empty(0)
        for one in self.plate.kinematics.strains[term.strain]:
            if term.axis == 0:
                (along_x, in_x), along_y, in_y = x.at_ends(term.at, one.along_x), y.derivatives[one.along_y], y.weights
            else:
                along_x, in_x, (along_y, in_y) = x.derivatives[one.along_x], x.weights, y.at_ends(term.at, one.along_y)
            total = total + one.factor * self._on_unknowns(one.field, np.einsum("ai,bj->abij", along_x, along_y))
            shares = np.outer(in_x, in_y).ravel()
        rows = np.reshape(total, (-1, self.n_dof))
        return rows, rows, shares

    def _at_places(self, term: AtPlaces) -> tuple[Floats, Floats, Floats]:
        left = np.stack([self._row(first) for _, first, _ in term.products])
        right = np.stack([self._row(second) for _, _, second in term.products])
        return left, right, np.array([factor for factor, _, _ in term.products])

    def _row(self, amount: Amount) -> Floats:
        row = np.zeros(self.n_dof)
        if amount.places:
            factors, at_x, at_y = np.array(amount.places).T
            along_x = self.plate.x.shapes(at_x, self.parity.x).toarray()
            along_y = self.plate.y.shapes(at_y, self.parity.y).toarray()
            row += self._on_unknowns("w", np.einsum("p,pi,pj->ij", factors, along_x, along_y))
        if amount.beside >= 0:
            row[self.n_on_plate + amount.beside] = 1.0
        return row

    def _on_unknowns(self, name: str, values: Floats) -> Floats:
        """Values on the unknowns, (..., n_dof), from (..., n_x, n_y) values on a field's functions."""
        numbers = self._numbering[0][name].ravel()
        kept = numbers >= 0
        found = np.zeros((*values.shape[:-2], self.n_dof))
        found[..., numbers[kept]] = values.reshape(*values.shape[:-2], -1)[..., kept]
        return found

    def _field(self, name: str, vectors: Floats) -> Floats:
        """A field of (n_dof, n_vectors) vectors on all functions: (n_vectors, n_x, n_y) array."""
        numbers = self._numbering[0][name]
        padded = np.vstack([vectors, np.zeros((1, vectors.shape[1]))])
        return np.moveaxis(padded[numbers], -1, 0)

    def deflections(self, vectors: Floats) -> Deflections:
        return Deflections(self.plate.x, self.plate.y, self.parity, self._field("w", vectors))

    def strains(self, names: Sequence[str], vectors: Floats) -> dict[str, Floats]:
        """Strains of (n_dof, n_vectors) vectors at the Gauss points: (n_vectors, n_points_x * n_points_y) arrays."""
        kinematics = self.plate.kinematics
        fields = {name: self._field(name, vectors) for name in kinematics.fields}
        along_x, along_y = self.plate.x.derivatives, self.plate.y.derivatives
        found: dict[str, Floats] = {}
        for name in dict.fromkeys(names):
            parts = (
                one.factor * (along_x[one.along_x] @ fields[one.field] @ along_y[one.along_y].T)
                for one in kinematics.strains[name]
            )
            found[name] = np.asarray(sum(parts)).reshape(vectors.shape[1], -1)
        return found

    def on_span(self, pencils: Sequence[tuple[Any, Any]], weights: Weights, vectors: Floats) -> tuple[Floats, Floats]:
        """Stiffness and mass of n draws on the span of (n_dof, n_vectors) vectors: (n, n_vectors, n_vectors).

        The pencils, as of `pencil`, are joined by the terms that exist on deflections only.
        """
        found = []
        for side, (terms, own) in enumerate(zip((self.plate.stiffness, self.plate.masses), weights, strict=True)):
            small = np.stack([vectors.T @ (pencil[side] @ vectors) for pencil in pencils])
            projected = [each for each in terms if isinstance(each[0], OnDeflections)]
            if projected:
                at = [isinstance(term, OnDeflections) for term, _ in each_weighed(terms)]
                small = small + np.tensordot(own[:, at], self._on_span(projected, vectors, _forms), axes=1)
            found.append(0.5 * (small + np.swapaxes(small, 1, 2)))
        return found[0], found[1]

    def project_stiffness(self, vectors: Floats) -> Floats:
        """All stiffness terms on the span of (n_dof, n_vectors) vectors: (n_terms, n_vectors, n_vectors) array."""
        return self._on_span(self.plate.stiffness, vectors, _forms)

    def project_masses(self, vectors: Floats) -> Floats:
        """All mass terms on the span of vectors: (n_masses, n_vectors, n_vectors) array."""
        return self._on_span(self.plate.masses, vectors, _forms)

    def energies(self, vectors: Floats) -> tuple[Floats, Floats]:
        """phi' K phi and phi' M phi of every term: (n_vectors, n_terms) and (n_vectors, n_masses) arrays."""
        stiffness, mass = (
            self._on_span(terms, vectors, _squares).T for terms in (self.plate.stiffness, self.plate.masses)
        )
        return stiffness, mass

    def _on_span(
        self,
        terms: Sequence[tuple[Term, Floats | None]],
        vectors: Floats,
        product: Callable[[Floats, Floats, Floats], Floats],
    ) -> Floats:
        """Products of what each term multiplies, on vectors."""
        over_plate = (term.strains for term, _ in terms if isinstance(term, OverPlate))
        strains = self.strains([name for both in over_plate for name in both], vectors)
        found = []
        for term, grid in terms:
            if isinstance(term, OverPlate):
                first, second = (strains[name] for name in term.strains)
                times = 1.0 if term.strains[0] == term.strains[1] else 2.0
                found.append(product(first, second, times * np.ravel(np.asarray(grid)))[None])
            elif isinstance(term, OnDeflections):
                n = vectors.shape[1]
                forms = np.reshape(term.project(self.deflections(vectors)), (term.n_terms, n, n))
                found.append(forms if product is _forms else np.diagonal(forms, axis1=1, axis2=2))
            else:
                left, right, shares = self._rows[term]
                found.append(product((left @ vectors).T, (right @ vectors).T, shares)[None])
        return np.concatenate(found)

    def project_beside(self, vectors: Floats) -> Floats:
        """What each mass term gives to the coordinates beside the plate: (n_masses, n_vectors, n_vectors) array."""
        beside = vectors[self.n_on_plate :]
        found = np.zeros((sum(1 for _ in each_weighed(self.plate.masses)), vectors.shape[1], vectors.shape[1]))
        for k, (term, _) in enumerate(each_weighed(self.plate.masses)):
            if isinstance(term, AtPlaces):
                for share, first, second in term.products:
                    if first.beside >= 0 and second.beside >= 0:
                        found[k] += share * np.outer(beside[first.beside], beside[second.beside])
        return found


def _forms(first: Floats, second: Floats, weights: Floats) -> Floats:
    """Weighted sums of products of all pairs of vectors, symmetric."""
    form = (first * weights) @ second.T
    return np.asarray(0.5 * (form + form.T))


def _squares(first: Floats, second: Floats, weights: Floats) -> Floats:
    """Weighted sums of products of each vector with itself."""
    return np.asarray((first * second) @ weights)
