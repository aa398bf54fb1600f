"""How the boards of the calibration are held, which modes are read and how large they are, by the name of a layout."""

from __future__ import annotations

import ritz

DAYS = ("monday", "friday")
EDGES = {"free": ritz.ALL_FREE, **dict.fromkeys(("cantilever", *DAYS), ritz.CANTILEVER)}
SETUPS = {"free": ("free",), "cantilever": ("cantilever",), "both": ("free", "cantilever"), "days": DAYS}
"""In which ways a board of a layout is held, one after the other."""
LABELS = {
    "free": ((1, 1), (2, 0), (0, 2), (2, 1), (1, 2), (3, 0), (2, 2), (3, 1)),
    "cantilever": ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2), (2, 0), (2, 1)),
    **dict.fromkeys(DAYS, ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2))),
}
HELD_OUT = {"free": (1, 3), **dict.fromkeys(("cantilever", *DAYS), (0, 3))}
"""A mode that is not read: its frequency is predicted."""
TWICE = {"free": (0, 2), "cantilever": (0, 2)}
"""The mode that tells most of a constant: what counting it twice would change most."""
EFFECTS = {"free": "support_stiffness", "cantilever": "clamp_rotation"}
"""An effect whose size is drawn and ranked too."""
LENGTHS = {"free": (0.45, 0.20), "cantilever": (0.30, 0.16), "both": (0.36, 0.18), "days": (0.30, 0.16)}
"""Sides, m, at which few modes of one class come close to each other over the prior."""
