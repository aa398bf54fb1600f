"""How an ideal plate rings: omega^2 is a ratio of energies, and modes are solved class by class of their symmetry.

The budget of a `plate` has stiffness and mass `terms`: those of the `thin` plate, of `shear`, of the `membrane` of a
board that is not flat, of the `air`, and `fields` where a property varies. On a `mesh`, with cubic functions along each
`line`, the terms are `forms`, and the matrices those of `classes`. `solve` gives eigenvalues and shapes, and `naming`
their labels, by products of `beams`. A `reduced` plate, made by a `reduction`, does the same thousands of times faster,
by `pencils`. `training` is the paper's way to its coefficients.
"""
