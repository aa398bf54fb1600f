"""Warp against the table of physics.md, a limit in closed form, another writing of the strains, its symmetries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

from generator.effects import (
    ClampRotation,
    GrainAngle,
    NoEffect,
    OutlineProfile,
    StiffnessGradient,
    ThicknessProfile,
    TransverseShear,
)
from generator.known_boards import BEAMS, FIEMME, FINNISH, HALF_TOP, cents
from generator.naming import frequencies
from generator.plate import EDGES, Plate, in_plane_stiffness, solve
from generator.warp import Warp, membrane_stiffness

MM = 1e-3
BOWL = Warp(1.3 * MM, 2.0 * MM, 16.0 * MM)
SADDLE = replace(BOWL, bow=-BOWL.bow)
TABLE = {
    "cup 1": (Warp(cup=1.0 * MM), [0.1, 30.3, 1.2, 0.0, 0.8, 10.8, 1.5, 0.9, 4.7]),
    "cup 2": (Warp(cup=2.0 * MM), [0.3, 115.0, 4.8, 0.1, 2.6, 42.7, 5.9, 3.8, 18.8]),
    "bow 2": (Warp(bow=2.0 * MM), [0.0, 0.4, 0.0, 29.4, 5.3, 0.4, 0.0, 4.1, 0.0]),
    "twist 8": (Warp(twist=8.0 * MM), [48.7, 0.0, 12.0, 0.0, 2.7, 0.2, 3.1, 3.1, 0.0]),
    "dome": (BOWL, [152.6, 52.2, 46.4, 31.7, 12.1, 25.2, 13.6, 23.9, 8.0]),
    "saddle": (SADDLE, [147.4, 73.2, 46.5, 29.7, 22.3, 15.6, 14.7, 13.2, 8.1]),
}
SHEAR = TransverseShear(0.62e9, 0.03e9)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize(("warp", "printed"), TABLE.values(), ids=TABLE)
def test_table_of_the_half_top(warp: Warp, printed: list[float], is_sheared: bool) -> None:
    """Printed to 0.1 cent by a solver of 13 polynomials: half a unit of the last digit and as much for that solver.

    So stiff in shear that only the rotary inertia is left, the shifts are the same.
    """
    plate = replace(HALF_TOP, shear=(1e13, 1e13)) if is_sheared else HALF_TOP

    assert cents(plate, [warp], BEAMS["half-top"]) == pytest.approx(printed, abs=0.1)


def test_flat_half_top_of_the_table_turns_with_its_mass() -> None:
    """Its frequencies, printed to 0.1 Hz, are those with rotary inertia: (2,2) lies 0.2 Hz lower than without."""
    printed = [48.9, 65.5, 118.8, 135.5, 165.6, 182.7, 233.3, 249.6, 355.6]
    found = frequencies(replace(HALF_TOP, shear=(1e13, 1e13)), (), BEAMS["half-top"])[0]
    thin = frequencies(HALF_TOP, (), BEAMS["half-top"])[0]

    assert list(found.values()) == pytest.approx(printed, abs=0.051)
    assert thin[2, 2] == pytest.approx(249.8, abs=0.051)


def test_stiff_cross_section_is_a_deeper_beam() -> None:
    """1 + (4/45) c^2 / (h^2 / 12) of an arc that keeps its shape; a thousand times stiffer it gives 0.03 cents way."""
    c = 1.0 * MM
    stiff = replace(HALF_TOP, E_y=1e3 * HALF_TOP.E_x, G_xy=1e3 * HALF_TOP.E_x, nu_xy=1e-4)
    flat, cupped = (solve(stiff, warp, n_modes=4).frequencies[3] for warp in ((), [Warp(cup=c)]))
    deeper = 600.0 * np.log2(1.0 + 4.0 / 45.0 * c**2 / (stiff.h**2 / 12.0))

    assert deeper == pytest.approx(52.02, abs=0.01)
    assert 1200.0 * np.log2(cupped / flat) == pytest.approx(deeper, abs=0.05)


def test_polynomials_have_converged() -> None:
    """Of the deflection from 13 x 11 on, and of the in-plane fields with two more than that: a hundredth of a cent."""
    shifts = {}
    for n, more in (((10, 8), 2), ((13, 11), 2), ((16, 14), 0), ((16, 14), 2), ((16, 14), 6)):
        flat, warped = (
            frequencies(HALF_TOP, effects, BEAMS["half-top"], n)[0] for effects in ((), [replace(BOWL, more=more)])
        )
        shifts[n, more] = np.array([1200.0 * np.log2(warped[mode] / flat[mode]) for mode in flat])
    best = shifts[(16, 14), 6]

    assert shifts[(10, 8), 2] == pytest.approx(best, abs=0.05)
    assert shifts[(13, 11), 2] == pytest.approx(best, abs=0.01)
    assert shifts[(16, 14), 2] == pytest.approx(best, abs=0.01)
    assert shifts[(16, 14), 0] == pytest.approx(best, abs=0.05)


@pytest.mark.parametrize("plate", [FINNISH, HALF_TOP, FIEMME], ids=["cantilever", "free", "clamped"])
def test_what_signs_mean(plate: Plate) -> None:
    """All at once change nothing, that of the twist alone nothing; a dome is no saddle."""
    warp = Warp(0.5 * MM, 0.8 * MM, 2.0 * MM)
    found = {
        signs: solve(plate, [Warp(*(np.multiply(signs, (warp.cup, warp.bow, warp.twist))))], 9).frequencies[3:]
        for signs in ((1, 1, 1), (-1, -1, -1), (1, 1, -1), (1, -1, 1))
    }

    assert found[-1, -1, -1] == pytest.approx(found[1, 1, 1], rel=1e-9)
    assert found[1, 1, -1] == pytest.approx(found[1, 1, 1], rel=1e-9)
    assert np.abs(1200.0 * np.log2(found[1, -1, 1] / found[1, 1, 1])).max() > 1.0


def test_curvatures_are_those_a_straightedge_shows() -> None:
    """The unloaded shape drawn from them: rises of the middles, a corner lifted off the plane of the other three."""
    plate = replace(HALF_TOP, L_x=0.55, covered=0.03, whole=0.58)
    xx, yy, twice_xy = BOWL.curvatures(plate)
    L_x, L_y = 0.58, plate.L_y

    def shape(x: float, y: float) -> float:
        x, y = x - 0.5 * L_x, y - 0.5 * L_y
        return 0.5 * xx * x**2 + 0.5 * yy * y**2 + 0.5 * twice_xy * x * y

    assert shape(0.5 * L_x, 0.0) - shape(0.5 * L_x, 0.5 * L_y) == pytest.approx(BOWL.cup)
    assert shape(0.0, 0.5 * L_y) - shape(0.5 * L_x, 0.5 * L_y) == pytest.approx(BOWL.bow)
    assert shape(L_x, L_y) - shape(L_x, 0.0) - shape(0.0, L_y) + shape(0.0, 0.0) == pytest.approx(BOWL.twist)


@pytest.mark.parametrize("edges", ["FFFF", "CFFF", "CCCC"])
def test_strains_written_with_the_slopes_of_the_shape(edges: str) -> None:
    """Marguerre: L u + (w_x w0_x, w_y w0_y, w_x w0_y + w_y w0_x) is L (u + w grad w0) - kappa w, to rounding."""
    words = {"C": "clamped", "F": "free"}
    plate = replace(HALF_TOP, edges=dict(zip(EDGES, (words[e] for e in edges), strict=True)))
    basis = plate.basis((7, 6))
    x, y, weights = basis.points
    xx, yy, twice_xy = curvatures = BOWL.curvatures(plate)
    slope_x, slope_y = xx * x + 0.5 * twice_xy * y, yy * y + 0.5 * twice_xy * x
    w_x, w_y = basis.deflection(x, y, 1, 0), basis.deflection(x, y, 0, 1)
    bent = np.stack(
        [slope_x[:, None] * w_x, slope_y[:, None] * w_y, slope_y[:, None] * w_x + slope_x[:, None] * w_y]
    ).reshape(-1, basis.size)
    fields = replace(basis, held=tuple((word == "clamped", False) for word in plate.edges.values()), n=(11, 10))
    u_x, u_y = fields.deflection(x, y, 1, 0), fields.deflection(x, y, 0, 1)
    nothing = np.zeros_like(u_x)
    stretched = np.block([[u_x, nothing], [nothing, u_y], [u_y, u_x]])
    root = np.kron(scipy.linalg.cholesky(in_plane_stiffness(plate, x[:1], y[:1])[..., 0]), np.eye(len(x)))
    root = root * np.tile(np.sqrt(weights), 3)
    settled = np.linalg.lstsq(root @ stretched, root @ bent, rcond=1e-10)[0]
    left = root @ (bent - stretched @ settled)
    found = membrane_stiffness(plate, basis, curvatures, more=4)

    assert found == pytest.approx(left.T @ left, abs=1e-8 * np.abs(found).max())


def test_stretching_grows_with_the_square_of_the_warp_and_with_the_thickness() -> None:
    basis = HALF_TOP.basis((8, 8))
    found = membrane_stiffness(HALF_TOP, basis, BOWL.curvatures(HALF_TOP))
    twice = membrane_stiffness(HALF_TOP, basis, 2.0 * BOWL.curvatures(HALF_TOP))
    thicker = membrane_stiffness(
        replace(HALF_TOP, thickness=(lambda x, y: np.full_like(x, 1.1),)), basis, BOWL.curvatures(HALF_TOP)
    )
    scale = np.abs(found).max()

    assert twice == pytest.approx(4.0 * found, abs=1e-9 * scale)
    assert thicker == pytest.approx(1.1 * found, abs=1e-9 * scale)


@pytest.mark.parametrize("effect", [None, SHEAR, GrainAngle(0.1)], ids=["thin", "shear-flexible", "across the grain"])
def test_rigid_motions_strain_nothing(effect: NoEffect | None) -> None:
    """Shifted or turned, a free shell stays as it is; the fourth motion bends."""
    found = solve(HALF_TOP, [BOWL, *([effect] if effect else [])], 4).frequencies

    assert found[:3] == pytest.approx(0.0, abs=0.05)
    assert found[3] > 40.0


@pytest.mark.parametrize("shear", [None, (0.62e9, 0.03e9)], ids=["thin", "shear-flexible"])
def test_turning_the_board_by_a_right_angle_changes_nothing(shear: tuple[float, float] | None) -> None:
    """Sides, edges, cup and bow exchanged and the grain turned by 90 degrees: 0.05 cents, a basis of 18 by 18."""
    plate = replace(FINNISH, shear=shear)
    warp = Warp(0.4 * MM, 0.9 * MM, 1.5 * MM)
    turned = replace(
        plate,
        L_x=plate.L_y,
        L_y=plate.L_x,
        edges={edge: plate.edges[other] for edge, other in zip(EDGES, ("y0", "y1", "x0", "x1"), strict=True)},
        grain=0.5 * np.pi,
    )
    found = solve(turned, [replace(warp, cup=warp.bow, bow=warp.cup)], 6, (18, 18)).frequencies
    expected = solve(plate, [warp], 6, (18, 18)).frequencies

    assert 1200.0 * np.log2(found / expected) == pytest.approx(0.0, abs=0.05)


def test_only_clamped_edges_hold_the_board_in_its_plane() -> None:
    """Supported all round it slides: a dome stiffens (0,0) much less than clamped springs of no resistance do."""
    supported = replace(FIEMME, edges=dict.fromkeys(EDGES, "supported"))
    dome = Warp(1.0 * MM, 1.0 * MM)
    slides = cents(supported, [dome], [(0, 0)])[0]
    loose = ClampRotation(1e-6)
    flat, held = (solve(FIEMME, [loose, *warp], 1).frequencies[0] for warp in ((), [dome]))

    assert frequencies(supported, (), [(0, 0)])[0][0, 0] == pytest.approx(flat, rel=1e-6)
    assert 1200.0 * np.log2(held / flat) > 2.0 * slides > 0.0


def test_a_saddle_of_equal_rises_does_not_stretch_under_one_half_wave() -> None:
    """Supported, w = sin sin: kx w_yy + ky w_xx is zero where cup = -bow, so there is no stress; a dome has some."""
    supported = replace(FIEMME, edges=dict.fromkeys(EDGES, "supported"))
    saddle, dome = (cents(supported, [Warp(1.0 * MM, bow)], [(0, 0)])[0] for bow in (-1.0 * MM, 1.0 * MM))

    assert saddle == pytest.approx(0.0, abs=1e-3)
    assert dome > 10.0


@pytest.mark.parametrize(
    "effect",
    [
        ThicknessProfile(1e-4),
        StiffnessGradient(1e-4),
        OutlineProfile((0.0, 0.3, HALF_TOP.L_x), (HALF_TOP.L_y, HALF_TOP.L_y, HALF_TOP.L_y - 1e-6)),
    ],
    ids=["taper", "gradient", "outline"],
)
def test_profiles_that_hardly_vary_change_hardly_anything(effect: NoEffect) -> None:
    """The sums over points against the uniform plate: profiles of 1e-4 shift a mode by 0.05 cents at most."""
    alone, beside = (frequencies(HALF_TOP, effects, BEAMS["half-top"])[0] for effects in ([BOWL], [effect, BOWL]))

    assert [1200.0 * np.log2(beside[mode] / alone[mode]) for mode in alone] == pytest.approx([0.0] * 9, abs=0.05)


def test_the_membrane_ends_at_the_outline() -> None:
    """A narrower rectangle inside wider polynomials is the narrower board; its cup goes with its width squared."""
    width, cup = 0.95 * HALF_TOP.L_y, 2.0 * MM
    narrow = replace(HALF_TOP, L_y=width)
    inside = replace(HALF_TOP, outline=((0.0, width), (HALF_TOP.L_x, width)))
    found = solve(inside, [Warp(cup)], 9, (11, 11)).frequencies[3:]
    expected = solve(narrow, [Warp(cup * 0.95**2)], 9, (11, 11)).frequencies[3:]

    assert found == pytest.approx(expected, rel=1e-6)
