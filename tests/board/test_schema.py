"""Snippets of cards and what is told of them: each fault with its place, what was wanted, what came, what to do."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_campaigns import TWO_BOARDS
from stated import CARD, PRIOR, assert_said, changed, read, told

from bayesplate.board.campaign import load_campaign
from bayesplate.board.checks import board_remarks
from bayesplate.board.coefficients import load_coefficients
from bayesplate.board.prior import load_prior
from bayesplate.commands.prepare import prepare
from bayesplate.errors import InputError
from bayesplate.labels import Label

LENGTH = "[plate] length_x_mm"
THICKNESS = "{ mean = 3.0, sd = 0.03 }"
MASS = "mass_g = 41.0"
SIDES = "length_x_mm = 253\nlength_y_mm = 114"
EDGES = '{ x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }'
ITEM = 'kind = "accelerometer"\nmass_g = { mean = 0.6, sd = 0.1 }\nat_mm = [200, 20]'
BARE = "[448.8, 594.1]\n"
FLUID = "[setup.fluid]\n"
FREE = '[[setup]]\nname = "free"\nedges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }\nunlabelled_hz = [9]\n'
NAME = "A-Z, a-z, 0-9, '.', '_' or '-', beginning with a letter or digit, at most 80 characters"
GRAMMAR = 'two whole numbers from 0 to 11, written like "(1,0)"'
ON_BOARD = "wanted a place on the free part of the board, x 30 to 253 mm, y 0 to 114 mm"
CORNER = "(from the corner of x0 and y0 of the whole board)"
CHANCE = "wanted a number from 1e-09 to 0.999999999"
PERCENT = "(a probability: 98 % is 0.98)"
TOO_MANY = "".join(f'"({m},{n})" = {100 + 41 * m + n}\n' for m in range(3, 10) for n in range(41))
OTHER = 'name: wanted "my-board", the name of the file, got'

FAULTS = [
    ("format = 1", "format = 2", "format: wanted 1, got 2 (this version reads card format 1)"),
    ("format = 1", "format = true", "format: wanted 1, got true (this…"),
    ("format = 1\n", "", "format: wanted 1, got nothing"),
    ("my-board", "../../x", f'{OTHER} "../../x"', f'name: wanted {NAME}, got "../../x"'),
    ("my-board", "nul.txt", f'{OTHER} "nul.txt"',
     'name: wanted a name that no operating system reserves for a device, got "nul.txt"'),
    ("my-board", "a" * 300, f'{OTHER} "{"a" * 60}..."', f'name: wanted {NAME}, got "{"a" * 60}..."'),
    ("my-board", "other", f'{OTHER} "other"'),
    ('"A test board"', "3", "title: wanted a text in quotes, got 3"),
    ("A test board", "\\u001b[2J", 'title: wanted a text without control characters, got "\\x1b[2J"'),
    ("transverse_shear", "transverse_sheer", 'effects 1: wanted "transverse_shear", "fluid_loading", …, '
     'got "transverse_sheer" (did you mean transverse_shear?)'),
    ('"transverse_shear"', '"air_loading", "fluid_loading"',
     'effects: wanted each name once, got "fluid_loading" twice'),
    ('["transverse_shear"]', '"warp"', 'effects: wanted a list of names of effects, got "warp"'),
    # numbers, and quantities
    ("253", "0", f"{LENGTH}: wanted a positive number, got 0"),
    ("253", "nan", f"{LENGTH}: wanted a finite number, got nan"),
    ("253", "true", f"{LENGTH}: wanted a number, got true"),
    ("253", '"52,5"', f'{LENGTH}: wanted a number, got "52,5" (a decimal point and no quotes: 52.5)'),
    ("253", '"1,024"', f'{LENGTH}: wanted a number, got "1,024" (ambiguous: write 1.024 or 1024, whichever is meant)'),
    ("253", '"N/A"', f'{LENGTH}: wanted a number, got "N/A"'),
    ("253", "2024-01-29", f"{LENGTH}: wanted a number, got a date or time"),
    ("253", "1e300", f"{LENGTH}: wanted a number from 1 to 100000 mm, got 1e+300"),
    ("253", "0.253", f"{LENGTH}: wanted a number from…, got 0.253 (in mm: 1 m is 1000 mm, 1 cm is 10 mm)"),
    ("253", "[]", f"{LENGTH}: wanted at least one of readings, got an empty list"),
    ("253", "{}", f"{LENGTH}: wanted {{ mean, sd }} or {{ readings, resolution }}, got an empty table"),
    ("253", "{ value = 3 }", f"{LENGTH}: wanted {{ mean, sd }} or {{…}}, got a table with value"),
    ("253", '[253, "x"]', f'{LENGTH} 2: wanted a number, got "x"'),
    ("253", "{ mean = 3 }", f"{LENGTH}.sd: wanted a value, got nothing"),
    ("253", "{ mean = 253, sd = 0 }", f"{LENGTH}.sd: wanted a positive number, got 0 (the number alone if it is…)"),
    ("253", "{ mean = 253, sd = 254 }", f"{LENGTH}.sd: wanted a number from 2.53e-07 to 253 mm, got 254 (the number…)"),
    ("253", "{ mean = 9, sd = 1, std = 2 }", f"{LENGTH}.std: wanted one of mean, sd, got an… (did you mean sd?)"),
    ("253", "{ readings = [9], resolution = -1 }", f"{LENGTH}.resolution: wanted a number from 0 to 100000 mm, got -1"),
    ("253", "{ readings = [253, 254], at_y_mm = [0] }", f"{LENGTH}.at_y_mm: wanted 2 places, one per reading, got 1"),
    ("253", "{ readings = [253], at_x_mm = [0] }",
     f"{LENGTH}.at_x_mm: wanted one of readings, resolution, at_y_mm, place_sd_mm, got an unknown key (did you mean…)"),
    # the plate and its material
    (LENGTH[8:] + " = 253\n", "", f"{LENGTH}: wanted the length along the grain in mm, got nothing"),
    (MASS, "desnity = 473", "[plate]: wanted exactly one of mass_g and density_kg_m3, got neither",
     "[plate] desnity: wanted one of length_x_mm, …, got an unknown key (did you mean density_kg_m3?)"),
    (MASS, MASS + "\ndensity_kg_m3 = 473", "[plate]: wanted exactly one of…, got both, 41.0 and 473"),
    (MASS, "density_kg_m3 = 0.47",
     "[plate] density_kg_m3: wanted a number from 1 to 30000 kg/m3, got 0.47 (in kg/m3: 1 g/cm3 is 1000 kg/m3)"),
    (THICKNESS, "{ readings = [3], at_x_mm = [0] }",
     "[plate] thickness_mm: wanted at_x_mm and at_y_mm together, got only at_x_mm"),
    (THICKNESS, "{ readings = [3], place_sd_mm = 20 }",
     "[plate] thickness_mm.place_sd_mm: wanted at_x_mm and at_y_mm beside it, got no places"),
    (THICKNESS, "{ readings = [3], at_x_mm = [0], at_y_mm = [0], place_sd_mm = -1 }",
     "[plate] thickness_mm.place_sd_mm: wanted a number from 0 to 1000 mm, got -1"),
    (MASS, MASS + "\nwarp_mm = 1", "[plate] warp_mm: wanted a table of cup, bow and twist, { cup = 0.8 }, got 1"),
    (MASS, MASS + "\nwarp_mm = { cup = -0.8 }",
     "[plate] warp_mm.cup: wanted a number from 0 to 1000 mm, got -0.8 (seen from below every warp has the other sign, "
     "and turning the board over changes nothing)"),
    (MASS, MASS + "\nwarp_mm = { twist = { mean = -1, sd = 1 } }",
     "[plate] warp_mm.twist.mean: wanted a number from 0 to 1000 mm, got -1 (seen from below…)"),
    (MASS, MASS + "\nwarp_mm = { cup = 12, bow = 26, twist = 26 }",
     "[plate] warp_mm.cup: wanted at most a tenth of the side, 11.4 mm, got 12 mm (in mm; a board is nearly flat)",
     "[plate] warp_mm.bow: wanted at most a tenth of the side, 25.3 mm, got 26 mm (…)",
     "[plate] warp_mm.twist: wanted at most a tenth of the side, 25.3 mm, got 26 mm (…)"),
    (MASS, MASS + "\nwarp_mm = { cupp = 1 }",
     "[plate] warp_mm.cupp: wanted one of cup, bow, twist, got an unknown key (did you mean cup?)"),
    (MASS, MASS + '\nnotes = "x"',
     "[plate] notes: wanted one of length_x_mm, …, got an unknown key (it belongs above the first table)"),
    ("poisson_xy = 0.51", "poisson_xy = 1.7", "[material] poisson_xy: wanted a number from -1.5 to 1.5, got 1.7"),
    ("poisson_xy = 0.51", 'prior = "a b"', f'[material] prior: wanted {NAME}, got "a b"'),
    ("poisson_xy = 0.51", 'isotropic = "yes"', '[material] isotropic: wanted true or false, got "yes"'),
    ("poisson_xy = 0.51", "isotropic = 1", "[material] isotropic: wanted true or false, got 1"),
    ("0.51", "0.51\nisotropic = true",
     "[material] poisson_xy: wanted more than -1 and at most 0.5 where isotropic = true, got 0.51 (the ratio of an…)"),
    ("0.51", "-1.0\nisotropic = true", "[material] poisson_xy: wanted more than -1 and…, got -1 (…)"),
    ("poisson_xy = 0.51", "thickness_mm = 3",
     "[material] thickness_mm: wanted one of poisson_xy, …, got an unknown key (it belongs in [plate])"),
    # the edges and what is said of the setup as a whole
    (EDGES, EDGES.replace(', y1 = "free"', ""),
     '[setup] edges.y1: wanted a word for each of the four edges x0, x1, y0, y1: "clamped", "supported" or "free", '
     "got nothing"),
    (EDGES, EDGES.replace("clamped", "clampd"),
     '[setup] edges.x0: wanted "clamped", "supported" or "free", got "clampd" (did you mean clamped?)'),
    (EDGES, EDGES.replace("x0", "left"), "[setup] edges.x0: wanted a word for each…, got nothing",
     "[setup] edges.left: wanted one of x0, x1, y0, y1, got an unknown key"),
    (EDGES, '"free"',
     '[setup] edges: wanted a table, got "free" (edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" })'),
    (EDGES, '"CFSF"',
     '[setup] edges: wanted a…, got "CFSF" (edges = { x0 = "clamped", x1 = "supported", y0 = "free", y1 = "free" })'),
    (EDGES, "4", "[setup] edges: wanted a table, got 4 (x0 is the edge at x = 0)"),
    ('"cantilever"', '"Board"', '[setup] name: wanted another name, got "board" (results use it for the board\'s…)'),
    ("{ x0 = 30 }", "{ x1 = 30 }", "[setup] clamped_mm.x1: wanted a clamped edge, got a free one"),
    ("{ x0 = 30 }", "30", "[setup] clamped_mm: wanted a table of clamped edges, { x0 = 30 }, got 30"),
    ("{ x0 = 30 }", "{ x0 = 253 }", "[setup] clamped_mm: wanted clamps that leave a part of the 253 mm along x free, "
     "got 253 mm clamped at x0, free only up to 253 mm"),
    ("[1, 0]", "[1]", "[setup] first_label: wanted two whole numbers, [1, 0], got a list of 1"),
    ("[1, 0]", "[1, -1]", "[setup] first_label 2: wanted a whole number from 0 to 2, got -1"),
    ("[1, 0]", "[1.0, 0]", "[setup] first_label 1: wanted a whole number from 0 to 2, got 1.0"),
    ("[1, 0]", "[2, 0]",
     '[setup] frequencies_hz."(1,0)": wanted labels not below first_label, (2,0), got (1,0) (first_label = [1, 0]?)',
     '[setup] frequencies_hz."(1,1)": wanted labels not below first_label, (2,0), got (1,1) (first_label = [1, 0]?)'),
    ("resolution_hz = 1\n", "resolution_hz = 0\n", "[setup] resolution_hz: wanted a positive number, got 0"),
    ("resolution_hz = 1\n", "resolution_hz = 13\n", "[setup] resolution_hz: wanted a rounding below a quarter of the "
     "lowest frequency, 52 Hz, got 13 Hz (the step of the last digit)"),
    ("factor = 2 }", "factor = 1 }", "[setup] noise_percent.factor: wanted a factor above 1, got 1 (1.65 is…)"),
    ("{ median = 0.5, factor = 2 }", "0.5",
     "[setup] noise_percent: wanted { median = 0.5, factor = 2 }, in percent, got 0.5"),
    # modes and peaks
    ("= 52", "= 0.052", '…."(1,0)": wanted a number from 0.1 to 1000000 Hz, got 0.052 (in Hz: 1 kHz is 1000 Hz)'),
    ("= 52", "= 0", '[setup] frequencies_hz."(1,0)": wanted a positive number, got 0 (in Hz; the zero-frequency…)'),
    ("= 52", "= { readings = [52], at_x_mm = [1] }", '…."(1,0)".at_x_mm: wanted one of readings, resolution, got an…'),
    ("= 52", '= 52\n"( 1, 0 )" = 53', '[setup] frequencies_hz: wanted the label (1,0) once, got "(1,0)" = 52 and '
     '"( 1, 0 )" = 53 (repeated measurements are a list: "(1,0)" = [.., ..])'),
    ("= 52", "= 52\nresolution_hz = 1", f'[setup] frequencies_hz.resolution_hz: wanted {GRAMMAR}, got "resolution_hz" '
     "(a key of [setup] stands above the table of labels)"),
    ("= 52", f"= 52\n{TOO_MANY}", "[setup] frequencies_hz: wanted at most 200 modes, got 290 (the modes that tell…)"),
    ('"(1,0)" = "+"', '"(1,0)" = "*"', '[setup] signs."(1,0)": wanted "+" or "-", got "*"'),
    ('"(1,0)" = "+"', '"(3,0)" = "+"', '[setup] signs."(3,0)": wanted a label among the frequencies_hz, got (3,0)'),
    (BARE, "448.8\n", "[setup] unlabelled_hz: wanted a list of frequencies, got 448.8"),
    (BARE, BARE + "label_confidence = 98\n",
     f"[setup] label_confidence: wanted a number from 1e-09 to 1, got 98 {PERCENT}"),
    (BARE, BARE + 'label_confidence = { "(1,0)" = 1.5 }\n',
     f'[setup] label_confidence."(1,0)": wanted a number from 1e-09 to 1, got 1.5 {PERCENT}'),
    (BARE, BARE + 'label_confidence = { "(3,0)" = 0.9 }\n',
     '[setup] label_confidence."(3,0)": wanted a label among the frequencies_hz, got (3,0)'),
    (BARE, BARE + 'label_confidence = { "(a)" = 0.9 }\n', f'…label_confidence."(a)": wanted {GRAMMAR}, got "(a)"'),
    (BARE, BARE + "missed_probability = 1\n", f"[setup] missed_probability: {CHANCE}, got 1 {PERCENT}"),
    (BARE, BARE + "spurious_probability = 1.0\n", f"[setup] spurious_probability: {CHANCE}, got 1.0 {PERCENT}"),
    (BARE, BARE + "missing_probability = 0.1\n",
     "[setup] missing_probability: wanted one of name, notes, …, got an… (did you mean missed_probability?)"),
    # readings with decimal commas, and readings that are not of one thing
    (THICKNESS, "[2,8, 2,7, 2,9]",
     "[plate] thickness_mm: wanted numbers without commas inside them, got [2, 8, 2, 7, 2, 9] (a decimal point: "
     "[2.8, 2.7, 2.9]; whole numbers so far apart are not readings of one thing)"),
    (THICKNESS, "{ readings = [2,85, 2,75], resolution = 0.05 }",
     "[plate] thickness_mm.readings: wanted numbers without commas inside them, …a decimal point: [2.85, 2.75]; …"),
    ("[98, 98, 99]", "[34,5, 35,2]", '…."(1,1)": wanted numbers without commas…a decimal point: [34.5, 35.2]; …'),
    ("[98, 98, 99]", "[1,250, 1,260]",
     '…."(1,1)": wanted numbers without commas… without a separator of thousands: [1250, 1260])'),
    (BARE, "[448,8, 594,1]\n", "[setup] unlabelled_hz: wanted numbers without commas inside them, got [448, 8, 594, 1] "
     "(a decimal point: [448.8, 594.1]; or the whole numbers in ascending order)"),
    (THICKNESS, "[2.8, 28]",
     "[plate] thickness_mm: wanted readings of one thing, the largest at most 2 times the smallest, got 2.8 and 28…"),
    (THICKNESS, "{ readings = [3.2, 3.1, 16], at_x_mm = [10, 100, 200], at_y_mm = [5, 50, 100] }",
     "[plate] thickness_mm.readings: wanted readings of one thing, the largest at most 5 times the smallest, got 3.1…"),
    ("[98, 98, 99]", "[98, 109]",
     '…."(1,1)": wanted readings of one thing, the largest at most 1.1 times the smallest, got 98 and 109 (one of…)'),
    ("[98, 98, 99]", "{ readings = [98, 98, 196], resolution = 1 }",
     '…."(1,1)".readings: wanted readings of one thing, …, got 98 and 196 (…)'),
    # what is on the board and around it
    ("[60, 20]", "60", "[setup] hammer.at_mm: wanted a place [x, y] in mm, got 60"),
    ("[60, 20]", "[60, -1]", f"[setup] hammer.at_mm: {ON_BOARD}, got [60, -1] {CORNER}"),
    ("[200, 20]", "[[200, 20], [3]]", "[setup] attached 1 at_mm 2: wanted a place [x, y] in mm, got a list of 1"),
    ("[200, 20]", "[260, 20]", f"[setup] attached 1 at_mm: {ON_BOARD}, got [260, 20] {CORNER}"),
    ("[200, 20]", "[[200, 20], [20, 20]]", f"[setup] attached 1 at_mm 2: {ON_BOARD}, got [20, 20] {CORNER}"),
    ("{ mean = 0.6, sd = 0.1 }", "41", "[setup] attached 1 mass_g: wanted less than the board's own 41 g, got 41 g"),
    ("\nat_mm = [200, 20]", "",
     "[setup] attached 1 at_mm: wanted a place, because the mass is declared, got nothing (at_mm = [x, y]; …)"),
    ("[[setup.attached]]", "[setup.attached]", "[setup] attached: wanted tables below [[setup.attached]], in double "
     "brackets, got a table with kind, mass_g, at_mm"),
    ('"accelerometer"', '"acelerometer"', '[setup] attached 1 kind: wanted "accelerometer", "exciter", "shaker" or '
     '"weight", got "acelerometer" (did you mean accelerometer?)'),
    (ITEM, ITEM + '\ncoil_mass_g = 0.1\nsuspension_n_per_m = 28\nresonance_hz = 28\nmagnet = "free"',
     '[setup] attached 1 coil_mass_g: wanted it on an exciter only, got a thing of kind "accelerometer" (…)',
     "[setup] attached 1 suspension_n_per_m: wanted it on an exciter only…",
     "[setup] attached 1 resonance_hz: wanted it on an exciter only…",
     "[setup] attached 1 magnet: wanted it on an exciter only…"),
    (ITEM, 'kind = "exciter"\nsuspension_n_per_m = 2700\nresonance_hz = 28',
     "[setup] attached 1 resonance_hz: wanted one of suspension_n_per_m and resonance_hz, got both (…)"),
    (ITEM, 'kind = "exciter"\nmass_g = 48\ncoil_mass_g = 48',
     "[setup] attached 1 coil_mass_g: wanted less than the whole exciter's 48 g, got 48 g (mass_g is coil and…)"),
    (ITEM, 'kind = "exciter"\nmagnet = "loose"', '[setup] attached 1 magnet: wanted "free" or "held", got "loose"'),
    (ITEM, 'kind = "exciter"\nat_mm = []', "[setup] attached 1 at_mm: wanted a place [x, y] in mm, got an empty list"),
    ('baffle = "none"', 'baffle = "half"', '[setup] fluid.baffle: wanted "none" or "full", got "half"'),
    (" = 1.2", " = 2001", "[setup] fluid.density_kg_m3: wanted a number from 1e-06 to 2000 kg/m3, got 2001 (…)"),
    (FLUID, f"[setup.air]\n{FLUID}",
     "[setup] air: wanted [setup.fluid] alone, which means the same, got both (leave [setup.air] out)"),
    (FLUID, f"[setup.support]\nbounce_hz = -1\n{FLUID}", "[setup] support.bounce_hz: wanted a positive number, got -1"),
    (FLUID, f"[setup.support]\nbounce_hz = 52\n{FLUID}",
     "[setup] support.bounce_hz: wanted less than the lowest mode, 52 Hz, got 52 Hz (the peak of a board that moves…)"),
    # what no board is like
    (MASS, "mass_g = 0.041",
     "[plate] mass_g: wanted a density from 20 to 25000 kg/m3, got 0.474 kg/m3 (0.041 kg is 41 g)",
     "[setup] attached 1 mass_g: wanted less than the board's own 0.041 g, got 0.6 g"),
    (MASS, "mass_g = 1.45", "[plate] mass_g: wanted a density…, got 16.8 kg/m3 (1.45 oz is 41.11 g)"),
    (MASS, "density_kg_m3 = 4.7", "[plate] density_kg_m3: wanted a density from 20 to 25000 kg/m3, got "
     "4.7 kg/m3 (mass in g, density in kg/m3, lengths in mm)", "[setup] attached 1 mass_g: …"),
    (THICKNESS, "60", "[plate] thickness_mm: wanted at most half the shorter side, 57 mm, got 60 mm (no plate is so "
     "thick; 60 thousandths of an inch would be 1.52 mm)"),
    (SIDES, "length_x_mm = 9.96\nlength_y_mm = 4.49", "[plate] mass_g: wanted a density from 20 to 25000 kg/m3, got "
     "3.06e+05 kg/m3 (sides of 9.96 and 4.49 inches would be 253 and 114 mm)",
     "[plate] thickness_mm: wanted at most half the shorter side, 2.245 mm, got 3 mm (no plate is so thick; sides of "
     "9.96 and 4.49 inches would be 253 and 114 mm)", "[setup] clamped_mm: …"),
    (THICKNESS, "{ readings = [3, 3], at_x_mm = [0, 254], at_y_mm = [0, 0] }",
     "[plate] thickness_mm.at_x_mm 2: wanted a place on the board, 0 to 253 mm, got 254 mm"),
    ("114", "{ readings = [114, 113], at_x_mm = [-1, 9] }",
     "[plate] length_y_mm.at_x_mm 1: wanted a place on the board, 0 to 253 mm, got -1 mm"),
]  # fmt: skip
"""A passage of the card, what stands in its place, and what is told then."""

PEAKS = """
[[setup.peaks]]
hz = { mean = 404.0, sd = 0.2 }
sign = "+"
amplitude = 0.4
damping_percent = 0.5
spurious_probability = 0.2

[[setup.peaks]]
hz = [671, 672]
"""
DAMPING = "(the damping ratio in percent: half the loss factor)"
AGAIN = "(repeated readings of one peak are a list: hz = [.., ..])"
FAULTS_OF_PEAKS = [
    ("hz = { mean = 404.0, sd = 0.2 }\n", "", "[setup] peaks 1 hz: wanted its frequency in Hz, got nothing"),
    ("mean = 404.0", "mean = 0.05",
     "[setup] peaks 1 hz.mean: wanted a number from 0.1 to 1000000 Hz, got 0.05 (in Hz: 1 kHz is 1000 Hz)"),
    ("[671, 672]", "[671, 771]", "[setup] peaks 2 hz: wanted readings of one thing, …, got 671 and 771 (…)"),
    ('sign = "+"', 'sign = "?"', '[setup] peaks 1 sign: wanted "+" or "-", got "?"'),
    ("amplitude = 0.4", "amplitude = 0", "[setup] peaks 1 amplitude: wanted a positive number, got 0"),
    ("damping_percent = 0.5", "damping_percent = 0",
     f"[setup] peaks 1 damping_percent: wanted a positive number, got 0 {DAMPING}"),
    ("damping_percent = 0.5", "damping_percent = 101",
     f"[setup] peaks 1 damping_percent: wanted a number from 1e-06 to 100 %, got 101 {DAMPING}"),
    ("spurious_probability = 0.2", "spurious_probability = 2",
     f"[setup] peaks 1 spurious_probability: {CHANCE}, got 2 {PERCENT}"),
    ("damping_percent", "damping", "[setup] peaks 1 damping: wanted one of hz, sign, amplitude, damping_percent, "
     "spurious_probability, got an unknown key (did you mean damping_percent?)"),
]  # fmt: skip

HEAD = CARD[: CARD.index("[material]")]
NO_MODES = CARD[: CARD.index("[setup.frequencies_hz]")] + CARD[CARD.index("[setup.hammer]") :]
MODES = 'wanted measured frequencies, "(1,0)" = 52, got no modes'
FIRST_PEAK = PEAKS[: PEAKS.rindex("[[setup.peaks]]")]
FAULTS_OF_WHOLE_CARDS = [
    (HEAD, "setup: wanted a [setup] table, or several [[setup]], got nothing"),
    ("setup = 3\n" + HEAD, "setup: wanted a list of [[setup]] tables, got 3"),
    ("setup = []\n" + HEAD, "setup: wanted at least one of [[setup]] tables, got an empty list"),
    (HEAD + FREE * 21, "setup: wanted at most 20 [[setup]] tables, got 21"),
    ("plate = 3\n" + FREE, "format: wanted 1, got nothing", "name: wanted…", "plate: wanted a table, got 3"),
    (FREE, "format: wanted 1…", "name: wanted the…", "plate: wanted a [plate] table, got nothing"),
    (HEAD + FREE + FREE, '[[setup]] 2 "free" name: wanted a name of its own, got "free" again'),
    (HEAD + FREE + FREE.replace('name = "free"', 'name = "FREE"'),
     '[[setup]] 2 "FREE" name: wanted a name of its own, got "FREE" again'),
    (HEAD + FREE + FREE.replace('name = "free"\n', ""),
     "[[setup]] 2 name: wanted a name, because there are several setups, got nothing"),
    (HEAD + FREE + FREE.replace('name = "free"', 'name = "b"').replace('x0 = "free"', 'x0 = "lose"'),
     '[[setup]] 2 "b" edges.x0: wanted "clamped", "supported" or "free", got "lose"'),
    (changed("unlabelled_hz = [448.8, 594.1]\n", "", text=NO_MODES), f"[setup] frequencies_hz: {MODES}"),
    (changed("unlabelled_hz = [448.8, 594.1]\n", "", text=NO_MODES) + PEAKS.replace("404.0", "-404.0"),
     "[setup] peaks 1 hz.mean: wanted a positive number, got -404.0 (…)"),
    (CARD + "[setup.peaks]\nhz = 404\n",
     "[setup] peaks: wanted tables below [[setup.peaks]], in double brackets, got a table with hz"),
    (CARD + "".join(f"[[setup.peaks]]\nhz = {100 + i}\n" for i in range(201)),
     "[setup] peaks: wanted at most 200 tables, got 201"),
    (CARD + PEAKS + FIRST_PEAK * 2, f"[setup] peaks 3: wanted a peak of its own, got peak 1 again {AGAIN}",
     f"[setup] peaks 4: wanted a peak of its own, got peak 1 again {AGAIN}"),
    # all faults at once, of the writing in the order of the card and of the meaning
    (changed("253", "-3", "first_label = [1, 0]", "first_label = 3", '"(1,0)" = "+"', '"(9,9)" = "+"',
             MASS, "", "baffle", "bafle", "amplitude = 0.4", "amplitude = -1", text=CARD + PEAKS),
     "[plate]: wanted exactly one of…", "[plate] length_x_mm: wanted a positive number, got -3",
     "[setup] first_label: …", "[setup] peaks 1 amplitude: …", '[setup] signs."(9,9)": …', "[setup] fluid.bafle: …"),
    (changed("[200, 20]", "[260, 20]", MASS, "mass_g = 0.041", "[1, 0]", "[2, 0]"),
     "[plate] mass_g: …", '[setup] frequencies_hz."(1,0)": …', '[setup] frequencies_hz."(1,1)": …',
     "[setup] attached 1 at_mm: …", "[setup] attached 1 mass_g: …"),
]  # fmt: skip


def test_every_fault_of_a_board_card_is_told_with_its_place_and_no_other():
    assert told(CARD) == []
    for old, new, *said in FAULTS:
        assert_said(told(changed(old, new)), said)
    for old, new, *said in FAULTS_OF_PEAKS:
        assert_said(told(changed(old, new, text=CARD + PEAKS)), said)
    for text, *said in FAULTS_OF_WHOLE_CARDS:
        assert_said(told(text), said)


def test_a_flood_of_faults_is_cut():
    found = told(changed(FLUID, "[setup.air]\n" + "".join(f"key{number} = 1\n" for number in range(500))))

    assert len(found) == 51
    assert found[-1] == ": wanted a card without faults, got 450 more faults, not listed"


SOUND = [
    (THICKNESS, "[2, 3, 2]"),
    (THICKNESS, "[1.5, 3.0]"),
    (THICKNESS, "[3, 3, 3, 4]"),
    (THICKNESS, "{ readings = [2, 5, 3, 6], at_x_mm = [0, 253, 0, 253], at_y_mm = [0, 0, 114, 114] }"),
    ("length_x_mm = 253", "length_x_mm = [250, 251]"),
    ("[98, 98, 99]", "[98, 107]"),
    (BARE, "[448, 594]\n"),
    (BARE, "[8, 51, 75, 127]\n"),
    (BARE, "[594, 448]\n"),
    (" = 1.2", " = 2000"),
    ("0.51", "0.5\nisotropic = true"),
    ("0.51", "-0.99\nisotropic = true"),
]


def test_what_is_unusual_and_sound_is_read():
    for old, new in SOUND:
        assert told(changed(old, new)) == [], new
    assert told(NO_MODES) == []
    assert told(changed("unlabelled_hz = [448.8, 594.1]\n", "", text=NO_MODES) + PEAKS) == []
    other_peaks = FIRST_PEAK.replace('"+"', '"-"') + "[[setup.peaks]]\nhz = 448.8\n[[setup.peaks]]\nhz = 52\n"
    assert told(CARD + PEAKS + other_peaks) == []


INDEX = st.integers(0, 11)
SPACE = st.text(" \t", max_size=3)
NO_LABELS = ["10", "(1;0)", "(1.0,0)", "(-1,0)", "(12,0)", "(0,12)", "(01,0)", "(1 1,0)", "1,0", "(1,0", "", "(1,0,0)"]
NO_LABELS += ["(m,n)", "(1,0)\n", "(١,٠)", "[1,0]"]


@given(INDEX, INDEX, SPACE, SPACE, SPACE, SPACE, SPACE)
def test_a_label_may_have_spaces_beside_its_numbers(m, n, a, b, c, d, e):
    label = Label.parse(f"{a}({b}{m}{c},{d}{n}{e})")

    assert label == Label(m, n)
    assert Label.parse(str(label)) == label


def test_nothing_else_is_a_label():
    for text in NO_LABELS:
        with pytest.raises(InputError, match=re.escape(f'mode label: wanted {GRAMMAR}, got "')):
            Label.parse(text)
    with pytest.raises(InputError, match="got 5"):
        Label.parse(5)


EITHER = "wanted all of E_x, E_y, G_xy or all of D_x, D_y, D_s"
DISTRIBUTION = '[E_y] distribution: wanted "log-normal" or "log-uniform"'
FAULTS_OF_A_PRIOR = [
    ("median_gpa = 12.0", "median_gpa = -1", "[E_x] median_gpa: wanted a positive number, got -1"),
    ("median_gpa = 12.0", "median_gpa = 1e300", "[E_x] median_gpa: wanted a number from 1e-06 to 1000000 GPa, …"),
    ("median_gpa = 12.0", "median_mpa = 12", "[E_x] median_mpa: wanted one of distribution, source, median_gpa, "
     "factor, got an unknown key (did you mean median_gpa?)", "[E_x] median_gpa: wanted a value, got nothing"),
    ("factor = 1.3\n", "factor = 1\n", "[E_x] factor: wanted a factor above 1, got 1 (…)"),
    ("factor = 1.3\n", "", "[E_x] factor: wanted a value, got nothing"),
    ("lower_gpa = 0.4", "lower_gpa = 2", "[E_y]: wanted lower_gpa below upper_gpa, got 2 and 2.0"),
    ("lower_gpa = 0.4", "lower_gpa = 0", "[E_y] lower_gpa: wanted a positive number, got 0"),
    ('"log-uniform"', '"uniform"', f'{DISTRIBUTION}, got "uniform"…'),
    ('distribution = "log-uniform"\n', "", f"{DISTRIBUTION}, got nothing"),
    ('source = "b"\n', "", "[E_y] source: wanted a value, got nothing"),
    ('source = "d"\n', "", "[noise_percent] source: wanted where the numbers come from, got nothing"),
    ("[E_y]", "[E_z]", f": {EITHER}, got E_x, G_xy", "[E_z]: wanted one of format, name…, got an… (did you mean…"),
    ("[E_y]", "[D_y]", f": {EITHER}, got E_x, G_xy, D_y", "[D_y] lower_gpa: …", "[D_y] upper_gpa: …",
     "[D_y] lower_n_m: …", "[D_y] upper_n_m: …"),
    ('[poisson_xy]\nmean = 0.37\nsd = 0.05\nsource = "e"', "[poisson_xy.mean]",
     "[poisson_xy] source: wanted where the numbers come from, got nothing"),
    ('"mine"', '"yours"', 'name: wanted "mine", the name of the file, got "yours"'),
]  # fmt: skip

COEFFICIENTS = """\
format = 1
name = "mine"
source = "a paper"
aspect_ratio = [223, 114]
first_label = [1, 0]
edges = { x0 = "clamped", x1 = "free", y0 = "free", y1 = "free" }
[training]
steps = [0.8, 1.2]
[coefficients]
"(1,0)" = { a = 3.21, b = -0.34, c = 0.00, r_squared = 1.00 }
"(1,1)" = { a = 3.99, b = 0.94, c = 40.5 }
"""
FAULTS_OF_COEFFICIENTS = [
    ("a = 3.21, ", "", '[coefficients] "(1,0)".a: wanted a value, got nothing'),
    ("r_squared = 1.00", "r_squared = 1.1", '[coefficients] "(1,0)".r_squared: wanted a number from 0 to 1, got 1.1'),
    ('"(1,1)"', '"( 1,0)"', '[coefficients]: wanted the label (1,0) once, got "(1,0)" = a table with a, b, c, r_sq…'),
    ("[223, 114]", "[223]", "aspect_ratio: wanted two numbers, [L_x, L_y], got a list of 1"),
    ("[223, 114]", "0", "aspect_ratio: wanted a positive number, got 0"),
    ("steps", "step", "[training] step: wanted one of length_x_mm, …, got an unknown key (did you mean steps?)"),
    ("[0.8, 1.2]", "0.8", "[training] steps: wanted a list of factors, got 0.8"),
    ('source = "a paper"\n', "", "source: wanted where the numbers come from, got nothing"),
]  # fmt: skip

FAULTS_OF_A_CAMPAIGN = [
    ('"my-campaign"', '"other"', 'name: wanted "my-campaign", the name of the file, got "other"'),
    ('"spruce-free-2L", ', "", "boards: wanted at least two boards, got 1 (bayesplate fit takes a single board's…)"),
    ("./my-board.toml", "spruce-free-2L", 'boards: wanted each board once, got "spruce-free-2L" again'),
    ("./my-board.toml", "my board", f'boards 2: wanted {NAME}, got "my board"'),
    ("attached_mass", "attached_mas", '[[shared]] 1 effect: wanted "transverse_shear", …, got "attached_mas"…'),
    ('as = "ratio"', "scatter_percent = 400", "[[shared]] 2 scatter_percent: wanted a number from 0.1 to 100 %…"),
    ('as = "ratio"', 'scatter_percent = "a little"', '[[shared]] 2 scatter_percent: wanted a number, got "a little"'),
    ("transverse_shear", "attached_mass", '[[shared]] 2 effect: wanted each effect once, got "attached_mass" again'),
    ('attached_mass"\n\n[[shared]]\neffect = "transverse_shear', 'fluid_loading"\n\n[[shared]]\neffect = "air_loading',
     '[[shared]] 2 effect: wanted each effect once, got "fluid_loading" again'),
    ('as = "ratio"', 'as = "rate"', '[[shared]] 2 as: wanted "value" or "ratio", got "rate" (did you mean ratio?)'),
    ('as = "ratio"', 'like = "ratio"', "[[shared]] 2 like: wanted one of effect, as, scatter_percent, got an…"),
    ('"spruce"', "3", "[population] prior: wanted a name, got 3"),
    ("title =", "tittle =", "tittle: wanted one of format, …, got an unknown key (did you mean title?)"),
]  # fmt: skip

OTHER_CARDS = [
    (load_prior, "mine", PRIOR, FAULTS_OF_A_PRIOR),
    (load_coefficients, "mine", COEFFICIENTS, FAULTS_OF_COEFFICIENTS),
    (load_campaign, "my-campaign", TWO_BOARDS, FAULTS_OF_A_CAMPAIGN),
]


@pytest.mark.parametrize(("load", "name", "text", "faults"), OTHER_CARDS, ids=["prior", "coefficients", "campaign"])
def test_every_fault_of_another_card_is_told_with_its_place_and_no_other(tmp_path, load, name, text, faults):
    path = tmp_path / f"{name}.toml"

    def told_of(written: str) -> list[str]:
        path.write_text(written, encoding="utf-8")
        with pytest.raises(InputError) as refused:
            load(path)
        return [str(fault).removeprefix(f"{path.name} ").removeprefix(path.name) for fault in refused.value.faults]

    for old, new, *said in faults:
        assert_said(told_of(changed(old, new, text=text)), said)
    each_at_once = changed("format = 1", "format = 2", *faults[0][:2], text=text)
    assert_said(sorted(told_of(each_at_once)), sorted(["format: wanted 1, got 2 (…)", faults[0][2]]))
    path.write_text(text, encoding="utf-8")
    assert load(path).name == name


NOISE = "{ median = 0.5, factor = 2 }"
MODE = "{ mean = 310, sd = 2 }"
CALIPER = "write thickness_mm = { mean = 2.8, sd = 0.05 }, or its readings"
THICK = "more than a tenth: transverse shear matters"
WARP = MASS + "\nwarp_mm = { cup = [0.8, 0.8], bow = [1.0, 1.1] }"
REMARKS = [
    (THICKNESS, "2.8", ("transverse_shear",), [CALIPER]),
    (THICKNESS, "{ readings = [2.8], resolution = 0 }", ("transverse_shear",), [CALIPER]),
    (THICKNESS, "[2.8]", (), ["were taken as rounded, thickness to 0.05 mm;"]),
    (THICKNESS, "{ readings = [2.8, 2.8] }", (), ["were taken as rounded, thickness to 0.05 mm;"]),
    (THICKNESS, "[2.8, 2.9]", (), []),
    (MASS, "mass_g = [41, 41]", (), ["were taken as rounded, mass to 1 g;"]),
    (MASS, WARP, (), ["were taken as rounded, cup to 0.1 mm;"]),
    (THICKNESS, "{ mean = 11.5, sd = 0.1 }", (), ["the thickness is 1/9.9 of the shorter side", THICK]),
    (THICKNESS, "{ mean = 11.5, sd = 0.1 }", ("warp",), [THICK, "declare it with --effects warp,transverse_shear"]),
    (THICKNESS, "{ mean = 11.5, sd = 0.1 }", ("transverse_shear",), []),
    (THICKNESS, "{ mean = 11.3, sd = 0.1 }", (), []),
    ("{ x0 = 30 }", "{ x0 = 224 }", (), [THICK]),
    (NOISE, "{ median = 21, factor = 2 }", (), ["setup 'cantilever': a noise of 21 % leaves"]),
    (NOISE, "{ median = 19.9, factor = 2 }", (), []),
    (MODE, "{ mean = 310, sd = 63 }", (), ["say next to nothing: (2,0)"]),
    (MODE, "{ mean = 310, sd = 61 }", (), []),
    ("resolution_hz = 1\n", "resolution_hz = 10\n", (), ["rounded to multiples of 10 Hz, and 52 of (1,0)", "are none"]),
    ("resolution_hz = 1\n", "resolution_hz = 0.73\n", (), []),
    ("resolution_hz = 1\n", "resolution_hz = 12.99\n", (), []),
    (MODE, "{ mean = 99.3, sd = 2 }", (), ["(1,1) and (2,0) are less than the rounding of 1 Hz apart"]),
    (MODE, "{ mean = 99.4, sd = 2 }", (), []),
    (BARE, "[448.8, 52]\n", (), ["the peak without a label at 52 Hz is where (1,0) is"]),
]


def test_what_a_card_leaves_to_be_assumed_or_to_be_doubted_is_remarked_on_once(tmp_path):
    for old, new, effects, passages in REMARKS:
        found = board_remarks(read(changed(old, new)), effects)
        assert len(found) == bool(passages), (new, found)
        assert all(passage in found[0] for passage in passages), (new, found)
    path = tmp_path / "my-board.toml"
    path.write_text(changed(THICKNESS, "2.8"), encoding="utf-8")
    assert [note for note in prepare(path).board.notes if CALIPER in note] != []


def test_a_clamp_over_the_whole_of_an_uncertain_length_leaves_nothing_free():
    uncertain = changed("length_x_mm = 253", "length_x_mm = { mean = 253, sd = 0.5 }", "{ x0 = 30 }", "{ x0 = 253 }")
    assert any(
        one.startswith("[setup] clamped_mm: wanted clamps that leave a part of the 253 mm") for one in told(uncertain)
    )


def test_a_board_of_peaks_alone_is_held_to_the_same_rules():
    peaks = changed("resolution_hz = 1", "resolution_hz = 200", text=NO_MODES)
    (rounding,) = (one for one in told(peaks) if "resolution_hz" in one)
    assert "a rounding below a quarter of the lowest frequency, 448.8 Hz, got 200 Hz" in rounding
    bouncing = changed(FLUID, f"[setup.support]\nbounce_hz = 449\n{FLUID}", text=NO_MODES)
    assert any("support.bounce_hz: wanted less than the lowest mode, 448.8 Hz" in one for one in told(bouncing))


def test_a_peak_that_stands_twice_is_told():
    twice = board_remarks(read(changed("[448.8, 594.1]", "[448.8, 594.1, 448.8]")), ())
    assert sum("several peaks without a label are at 448.8 Hz" in one for one in twice) == 1
    assert not any("several peaks" in one for one in board_remarks(read(CARD), ()))
