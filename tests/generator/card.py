"""A board card written out as text, in the format that the package's README of cards shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from generator.designs import POISSON, SHEAR_MEANS, Design, Setup
from generator.naming import Label

NOISE_FACTOR = 1.65
LEAST_NOISE_CENTS = 0.1
"""A card must state some noise; less than this is stated as this."""

NOTHING: Mapping[str, str] = {}
ACCELEROMETER = '"accelerometer"'
_OF_EXCITERS = ("coil_mass_g", "suspension_n_per_m", "resonance_hz", "magnet")
_OF_SETUPS = ("noise_percent", "air", "fluid", "kind", "mass_g", "exciter_mass_g", *_OF_EXCITERS, "clamped_x0_mm")


def card_text(
    name: str,
    design: Design,
    readings: Mapping[str, Mapping[Label, float]],
    *,
    noise_cents: float,
    noise_factor: float = NOISE_FACTOR,
    resolution: float = 0.0,
    places: Sequence[tuple[float, float]] = (),
    driven: Sequence[tuple[float, float]] = (),
    outline: Mapping[str, Any] | None = None,
    prior: str = "",
    stated: Mapping[str, str] = NOTHING,
) -> str:
    """The card of a simulated board.

    readings: setup name -> laboratory's label -> Hz; places, m, of an accelerometer whose mass is not stated, and
    driven, of an exciter, which stands on the card even without a place where its mass is stated; outline: stations and
    widths, m; stated: key of the card -> its value as TOML, in place of what stands there otherwise, or besides
    (length_y_mm, thickness_mm, warp_mm, poisson_xy, shear_xz_gpa, shear_yz_gpa, effects, exciter_mass_g, clamped_x0_mm
    and those of `_OF_SETUPS`).
    """
    width = f"{_mm(design.L_y)}"
    if outline:
        width = f"{{ readings = {_list(outline['widths'])}, at_x_mm = {_list(outline['stations'])} }}"
    noise = f"{{ median = {noise_percent(noise_cents):.6g}, factor = {noise_factor:g} }}"
    of_setups = {"noise_percent": noise} | {key: stated[key] for key in _OF_SETUPS if key in stated}
    if resolution:
        of_setups["resolution_hz"] = f"{resolution:g}"
    lines = [
        "format = 1",
        f'name = "{name}"',
        f'title = "A simulated board, {design.name}"',
        'source = "computed by tests/generator, an independent discretisation; noise added"',
        *([f"effects = {stated['effects']}"] if "effects" in stated else []),
        "",
        "[plate]",
        f"length_x_mm = {_mm(design.L_x)}",
        f"length_y_mm = {stated.get('length_y_mm', width)}",
        f"thickness_mm = {stated.get('thickness_mm', _mm(design.h))}",
        f"density_kg_m3 = {design.rho:.6g}",
        *([f"warp_mm = {stated['warp_mm']}"] if "warp_mm" in stated else []),
        "",
        "[material]",
        *_material_lines(stated),
        *([f'prior = "{prior}"'] if prior else []),
    ]
    for setup in design.setups:
        lines += ["", *_setup_lines(setup, readings[setup.name], places, driven, of_setups)]
    return "\n".join(lines) + "\n"


def noise_percent(cents: float) -> float:
    """A noise in cents as a relative one, percent."""
    return 100.0 * (2.0 ** (max(cents, LEAST_NOISE_CENTS) / 1200.0) - 1.0)


def _material_lines(stated: Mapping[str, str]) -> list[str]:
    """Poisson ratio and shear moduli."""
    shear = {key: f"{{ mean = {mean / 1e9:.6g}, sd = {sd / 1e9:.6g} }}" for key, (mean, sd) in SHEAR_MEANS.items()}
    return [
        f"poisson_xy = {stated.get('poisson_xy', POISSON)}",
        f"shear_xz_gpa = {stated.get('shear_xz_gpa', shear['G_xz'])}",
        f"shear_yz_gpa = {stated.get('shear_yz_gpa', shear['G_yz'])}",
    ]


def _setup_lines(
    setup: Setup,
    hertz: Mapping[Label, float],
    places: Sequence[tuple[float, float]],
    driven: Sequence[tuple[float, float]],
    stated: Mapping[str, str],
) -> list[str]:
    edges = ", ".join(f'{edge} = "{word}"' for edge, word in setup.edges.items())
    sensor = {"mass_g": stated.get("mass_g")}
    drive = {"mass_g": stated.get("exciter_mass_g")} | {key: stated.get(key) for key in _OF_EXCITERS}
    return [
        "[[setup]]",
        f'name = "{setup.name}"',
        f"edges = {{ {edges} }}",
        *([f"clamped_mm = {{ x0 = {stated.get('clamped_x0_mm', _mm(setup.covered))} }}"] if setup.covered else []),
        f"first_label = [{setup.first_label[0]}, {setup.first_label[1]}]",
        f"noise_percent = {stated['noise_percent']}",
        *([f"resolution_hz = {stated['resolution_hz']}"] if "resolution_hz" in stated else []),
        *([f"air = {stated['air']}"] if "air" in stated else []),
        *([f"fluid = {stated['fluid']}"] if "fluid" in stated else []),
        "",
        "[setup.frequencies_hz]",
        *(f'"({m},{n})" = {value:.9g}' for (m, n), value in sorted(hertz.items(), key=lambda item: item[1])),
        *(_attached_lines(stated.get("kind", ACCELEROMETER), places, sensor) if places else []),
        *(_attached_lines('"exciter"', driven, drive) if driven or "exciter_mass_g" in stated else []),
    ]


def _attached_lines(kind: str, places: Sequence[tuple[float, float]], told: Mapping[str, str | None]) -> list[str]:
    """An item that is attached at places, or somewhere, with what is told of it."""
    at = [f"[{_mm(x)}, {_mm(y)}]" for x, y in places]
    return [
        "",
        "[[setup.attached]]",
        f"kind = {kind}",
        *(f"{key} = {value}" for key, value in told.items() if value is not None),
        *([f"at_mm = {at[0] if len(at) == 1 else '[' + ', '.join(at) + ']'}"] if at else []),
    ]


def told(effects: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """What scales and a straightedge say of planted effects, as a card states it: see `stated` of `card_text`."""
    keys: dict[str, str] = {}
    if warp := effects.get("warp"):
        keys["warp_mm"] = f"{{ {', '.join(f'{name} = {_mm(value)}' for name, value in warp.items())} }}"
    if drive := effects.get("exciter"):
        keys["exciter_mass_g"], keys["coil_mass_g"] = (f"{1e3 * drive[name]:.6g}" for name in ("mass", "coil_mass"))
        keys["suspension_n_per_m"], keys["magnet"] = f"{drive['suspension']:.6g}", f'"{drive["magnet"]}"'
    return keys


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g}"


def _list(metres: Sequence[float]) -> str:
    return "[" + ", ".join(_mm(value) for value in metres) + "]"
