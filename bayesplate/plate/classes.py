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
from bayesplate.plate.forms import Elements, Forms, weighed_terms
from bayesplate.plate.terms import (
    Deflections,
    EdgeTerm,
    Parity,
    PlateTerm,
    PointMotion,
    PointTerm,
    ProjectedTerms,
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
        """Number of each field's unknown by its functions along x and along y, -1 where there is none; their count."""
        x, y = self.plate.x, self.plate.y
        is_sheared = len(self.plate.kinematics.fields) > 1
        along_x, along_y = (
            x.deflection_functions(self.parity.x, is_sheared),
            y.deflection_functions(self.parity.y, is_sheared),
        )
        masks = {"w": np.outer(along_x, along_y)}
        if is_sheared:
            masks["g_x"] = np.outer(x.strain_functions(self.parity.x), along_y)
            masks["g_y"] = np.outer(along_x, y.strain_functions(self.parity.y))
        numbers, n = {}, 0
        for name, mask in masks.items():
            numbers[name] = np.where(mask, n - 1 + np.cumsum(mask).reshape(mask.shape), -1)
            n += int(mask.sum())
        if is_sheared:  # at a clamp the cross-section does not turn: the strain there is the slope of the deflection
            for value, slope in x.ties():
                numbers["g_x"][value] = numbers["w"][slope]
            for value, slope in y.ties():
                numbers["g_y"][:, value] = numbers["w"][:, slope]
        return numbers, n

    @property
    def n_on_plate(self) -> int:
        """Number of unknowns of the plate itself; the coordinates beside the plate come after them."""
        return self._numbering[1]

    @property
    def n_dof(self) -> int:
        return self.n_on_plate + self.plate.n_coordinates

    @cached_property
    def n_rigid(self) -> int:
        """Number of rigid motions of the whole plate in this class."""
        ends = self.plate.x.ends, self.plate.y.ends
        return sum(is_rigid(beams, *ends) and self.plate.parity(beams) == self.parity for beams in np.ndindex(2, 2))

    def pencil(self, elements: tuple[Elements, Elements]) -> tuple[Any, Any]:
        """Sparse (n_dof, n_dof) stiffness and mass from the plate's elements."""
        stiffness, mass = (self._assemble(terms) for terms in elements)
        return stiffness, mass

    def _assemble(self, elements: Elements) -> Any:
        from scipy.sparse import csc_array

        is_kept, stored_at, indices, indptr = self._sparsity_pattern
        values = np.concatenate([self._block_values(elements, fields) for fields in self._field_pairs])
        stored = np.bincount(stored_at, values[is_kept], indices.size)
        matrix = csc_array((stored, indices, indptr), shape=(self.n_dof, self.n_dof))
        if not elements.elsewhere:
            return matrix
        left, right, rows_of_term = self._stacked_rows
        scales = np.concatenate([weight * self._term_rows[term][2] for term, weight in elements.elsewhere])
        rows = np.concatenate([rows_of_term[term] for term, _ in elements.elsewhere])[scales != 0.0]
        form = left[rows].T @ (right[rows] * scales[scales != 0.0][:, None])
        return csc_array(matrix + 0.5 * (form + form.T))

    @cached_property
    def _stacked_rows(self) -> tuple[Any, Any, dict[Term, Indices]]:
        """`_term_rows` of all terms stacked: sparse left and right (n, n_dof) arrays, and the rows of each term."""
        from scipy.sparse import csr_array

        left, right = (csr_array(np.concatenate([rows[i] for rows in self._term_rows.values()])) for i in (0, 1))
        ends = np.cumsum([shares.size for _, _, shares in self._term_rows.values()])
        places = (
            np.arange(end - shares.size, end)
            for end, (_, _, shares) in zip(ends, self._term_rows.values(), strict=True)
        )
        return left, right, dict(zip(self._term_rows, places, strict=True))

    @property
    def _field_pairs(self) -> list[tuple[str, str]]:
        return list(combinations_with_replacement(self.plate.kinematics.fields, 2))

    def _block_values(self, elements: Elements, pair: tuple[str, str]) -> Floats:
        """Entries of a block of two fields, and of the mirrored one where they differ."""
        local = elements.over_plate.get(pair)
        if local is None:
            n_elements = len(self.plate.x.unknowns) * len(self.plate.y.unknowns)
            local = np.zeros((n_elements, 16, 16))
        return local.ravel() if pair[0] == pair[1] else np.concatenate([local.ravel(), local.swapaxes(1, 2).ravel()])

    @cached_property
    def _sparsity_pattern(self) -> tuple[Bools, Indices, NDArray[np.int32], NDArray[np.int32]]:
        """Which entries of the elements are kept, where each is stored, and the row indices and column starts there."""
        numbers = {name: self._element_unknowns(name) for name in self.plate.kinematics.fields}
        rows, columns = [], []
        for first, second in self._field_pairs:
            for a, b in dict.fromkeys(((first, second), (second, first))):
                pair = np.broadcast_arrays(numbers[a][:, :, None], numbers[b][:, None, :])
                rows.append(pair[0].ravel())
                columns.append(pair[1].ravel())
        row, column = np.concatenate(rows), np.concatenate(columns)
        is_kept = (row >= 0) & (column >= 0)
        places, stored_at = np.unique(column[is_kept] * self.n_dof + row[is_kept], return_inverse=True)
        indptr = np.searchsorted(places, np.arange(self.n_dof + 1) * self.n_dof)
        return is_kept, stored_at, (places % self.n_dof).astype(np.int32), indptr.astype(np.int32)

    def _element_unknowns(self, name: str) -> Indices:
        """Number of each element's unknowns of a field, in the order of `Plate.elements`: (n_elements, 16) array."""
        x, y = self.plate.x.unknowns, self.plate.y.unknowns
        numbers = self._numbering[0][name][x[None, :, :, None], y[:, None, None, :]]
        return numbers.reshape(len(x) * len(y), 16)

    @cached_property
    def _term_rows(self) -> dict[Term, tuple[Floats, Floats, Floats]]:
        """The two factors of each edge or point term, (n, n_dof) rows left and right, and (n,) weights of products."""
        terms = (term for term, _ in (*self.plate.stiffness, *self.plate.masses))
        return {
            term: self._edge_rows(term) if isinstance(term, EdgeTerm) else self._point_rows(term)
            for term in terms
            if isinstance(term, EdgeTerm | PointTerm)
        }

    def _edge_rows(self, term: EdgeTerm) -> tuple[Floats, Floats, Floats]:
        x, y = self.plate.x, self.plate.y
        total: Floats | float = 0.0
        shares = np.empty(0)
        for d in self.plate.kinematics.strains[term.strain]:
            if term.axis == 0:
                (along_x, in_x), along_y, in_y = x.at_ends(term.at, d.along_x), y.derivatives[d.along_y], y.weights
            else:
                along_x, in_x, (along_y, in_y) = x.derivatives[d.along_x], x.weights, y.at_ends(term.at, d.along_y)
            total = total + d.factor * self._on_unknowns(d.field, np.einsum("ai,bj->abij", along_x, along_y))
            shares = np.outer(in_x, in_y).ravel()
        rows = np.reshape(total, (-1, self.n_dof))
        return rows, rows, shares

    def _point_rows(self, term: PointTerm) -> tuple[Floats, Floats, Floats]:
        left = np.stack([self._motion_row(first) for _, first, _ in term.products])
        right = np.stack([self._motion_row(second) for _, _, second in term.products])
        return left, right, np.array([factor for factor, _, _ in term.products])

    def _motion_row(self, motion: PointMotion) -> Floats:
        row = np.zeros(self.n_dof)
        if motion.places:
            factors, at_x, at_y = np.array(motion.places).T
            along_x = self.plate.x.shapes(at_x, self.parity.x).toarray()
            along_y = self.plate.y.shapes(at_y, self.parity.y).toarray()
            row += self._on_unknowns("w", np.einsum("p,pi,pj->ij", factors, along_x, along_y))
        if motion.coordinate >= 0:
            row[self.n_on_plate + motion.coordinate] = 1.0
        return row

    def _on_unknowns(self, name: str, values: Floats) -> Floats:
        """Values on the unknowns, (..., n_dof), from (..., n_x, n_y) values on a field's functions."""
        numbers = self._numbering[0][name].ravel()
        is_kept = numbers >= 0
        on_unknowns = np.zeros((*values.shape[:-2], self.n_dof))
        on_unknowns[..., numbers[is_kept]] = values.reshape(*values.shape[:-2], -1)[..., is_kept]
        return on_unknowns

    def _field_on_functions(self, name: str, vectors: Floats) -> Floats:
        """A field of (n_dof, n_vectors) vectors on all functions: (n_vectors, n_x, n_y) array."""
        numbers = self._numbering[0][name]
        padded = np.vstack([vectors, np.zeros((1, vectors.shape[1]))])
        return np.moveaxis(padded[numbers], -1, 0)

    def deflections(self, vectors: Floats) -> Deflections:
        return Deflections(self.plate.x, self.plate.y, self.parity, self._field_on_functions("w", vectors))

    def strains(self, names: Sequence[str], vectors: Floats) -> dict[str, Floats]:
        """Strains of (n_dof, n_vectors) vectors at the Gauss points: (n_vectors, n_points_x * n_points_y) arrays."""
        kinematics = self.plate.kinematics
        fields = {name: self._field_on_functions(name, vectors) for name in kinematics.fields}
        along_x, along_y = self.plate.x.derivatives, self.plate.y.derivatives
        strains: dict[str, Floats] = {}
        for name in dict.fromkeys(names):
            products = (
                d.factor * (along_x[d.along_x] @ fields[d.field] @ along_y[d.along_y].T)
                for d in kinematics.strains[name]
            )
            strains[name] = np.asarray(sum(products)).reshape(vectors.shape[1], -1)
        return strains

    def on_span(self, pencils: Sequence[tuple[Any, Any]], weights: Weights, vectors: Floats) -> tuple[Floats, Floats]:
        """Stiffness and mass of n draws on the span of (n_dof, n_vectors) vectors: (n, n_vectors, n_vectors).

        `pencils` holds a `pencil` of each draw; the projected terms, which pencils lack, are added.
        """
        forms = []
        for side, (terms, columns) in enumerate(zip((self.plate.stiffness, self.plate.masses), weights, strict=True)):
            form = np.stack([vectors.T @ (pencil[side] @ vectors) for pencil in pencils])
            projected = [pair for pair in terms if isinstance(pair[0], ProjectedTerms)]
            if projected:
                at = [isinstance(term, ProjectedTerms) for term, _ in weighed_terms(terms)]
                form = form + np.tensordot(columns[:, at], self._on_span(projected, vectors, _pair_sums), axes=1)
            forms.append(0.5 * (form + np.swapaxes(form, 1, 2)))
        return forms[0], forms[1]

    def project_stiffness(self, vectors: Floats) -> Floats:
        """All stiffness terms on the span of (n_dof, n_vectors) vectors: (n_terms, n_vectors, n_vectors) array."""
        return self._on_span(self.plate.stiffness, vectors, _pair_sums)

    def project_masses(self, vectors: Floats) -> Floats:
        """All mass terms on the span of vectors: (n_masses, n_vectors, n_vectors) array."""
        return self._on_span(self.plate.masses, vectors, _pair_sums)

    def energies(self, vectors: Floats) -> tuple[Floats, Floats]:
        """phi' K phi and phi' M phi of every term: (n_vectors, n_terms) and (n_vectors, n_masses) arrays."""
        stiffness, mass = (
            self._on_span(terms, vectors, _square_sums).T for terms in (self.plate.stiffness, self.plate.masses)
        )
        return stiffness, mass

    def _on_span(
        self,
        terms: Sequence[tuple[Term, Floats | None]],
        vectors: Floats,
        product: Callable[[Floats, Floats, Floats], Floats],
    ) -> Floats:
        """Each term on the span of vectors: `product` of its two strains, `_pair_sums` or `_square_sums`."""
        over_plate = (term.strains for term, _ in terms if isinstance(term, PlateTerm))
        strains = self.strains([name for pair in over_plate for name in pair], vectors)
        products = []
        for term, grid in terms:
            if isinstance(term, PlateTerm):
                first, second = (strains[name] for name in term.strains)
                factor = 1.0 if term.strains[0] == term.strains[1] else 2.0
                products.append(product(first, second, factor * np.ravel(np.asarray(grid)))[None])
            elif isinstance(term, ProjectedTerms):
                n = vectors.shape[1]
                forms = np.reshape(term.project(self.deflections(vectors)), (term.n_terms, n, n))
                products.append(forms if product is _pair_sums else np.diagonal(forms, axis1=1, axis2=2))
            else:
                left, right, shares = self._term_rows[term]
                products.append(product((left @ vectors).T, (right @ vectors).T, shares)[None])
        return np.concatenate(products)

    def project_coordinates(self, vectors: Floats) -> Floats:
        """Mass terms of the coordinates beside the plate alone: (n_masses, n_vectors, n_vectors) array."""
        beside = vectors[self.n_on_plate :]
        masses = np.zeros((sum(1 for _ in weighed_terms(self.plate.masses)), vectors.shape[1], vectors.shape[1]))
        for k, (term, _) in enumerate(weighed_terms(self.plate.masses)):
            if isinstance(term, PointTerm):
                for share, first, second in term.products:
                    if first.coordinate >= 0 and second.coordinate >= 0:
                        masses[k] += share * np.outer(beside[first.coordinate], beside[second.coordinate])
        return masses


def _pair_sums(first: Floats, second: Floats, weights: Floats) -> Floats:
    """Weighted sums of products of all pairs of vectors, symmetric."""
    form = (first * weights) @ second.T
    return np.asarray(0.5 * (form + form.T))


def _square_sums(first: Floats, second: Floats, weights: Floats) -> Floats:
    """Weighted sums of products of each vector with itself."""
    return np.asarray((first * second) @ weights)
