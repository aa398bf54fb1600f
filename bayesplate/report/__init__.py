"""Figures and pages for people: the only room that plots.

Figures. Those of the `board`, of `chladni` figures, `constants`, `modes`, the `posterior`, a `corner_plot`, a
`diagnosis` and `planning` each have a file, in one `style`; `plots` makes them on request, `saving` writes them.

Pages. `page` is that of a fit or a diagnosis, with its sentences (`content`) and its `verdict`; a `campaign`, a
`grading` and `recordings` have pages of their own.
"""
