"""How far a mesh half again as fine moves the frequencies: `python tests/validation/reference/mesh.py`.

What the production mesh leaves open is no difference: `compare.py` lets a frequency lie anywhere between the stored one
and that of an infinitely fine mesh. Run once, on the tree of the reference, whose meshes it refines by hand.
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # as `make`; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.reference.make import HERE
from validation.reference.plates import plate_frequencies, read_plates
from validation.reference.results import present_tree, read, write

FINER = 1.5
_TOLD = 0.02
"""Cents; a fifth of the tolerance."""


def main() -> None:
    """Write mesh.json: by plate and label the cents of a finer mesh, where they count."""
    from bayesplate.frequencies import system

    for name in ("ELEMENTS_PER_SIDE", "SHEAR_ELEMENTS_PER_SIDE"):
        setattr(system, name, round(FINER * getattr(system, name)))
    stored, found = read(HERE / "plates.json"), {}
    for name, plate in read_plates().items():
        finer = plate_frequencies(name, {**plate, "at_moved": False})["as stated"]
        before = stored[name]["as stated"]
        cents = {label: 1200.0 * math.log2(finer[label] / before[label]) for label in before if label in finer}
        moved = {label: round(one, 2) for label, one in cents.items() if abs(one) > _TOLD}
        found[name] = {"made_on": present_tree(), "cents": moved}
    write(HERE / "mesh.json", found)


if __name__ == "__main__":
    main()
