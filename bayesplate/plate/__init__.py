"""How an ideal plate rings: omega^2 is a ratio of energies, and modes are solved class by class of their symmetry.

Energies. A `plate` has stiffness and mass `terms`: those of a `thin` plate or of one that gives way in `shear`, of the
`membrane` of a board that is not flat, and of the `air`. Where a property varies, `fields` weigh them.

Finite elements. `mesh` says how many, `line` has the cubic functions along one side, `forms` the terms on products of
these, and `classes` the matrices of each symmetry class.

Modes. `solve` gives eigenvalues and shapes, `naming` their labels, by the products of `beams` functions that they
resemble.

Many draws. A `reduced` plate, made by `reduction`, does the same thousands of times faster; `pencils` are its small
eigenvalue problems.

The paper. `training` is its way to the coefficients a, b, c: twenty-five computed plates.
"""
