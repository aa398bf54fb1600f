"""Figures and pages for people: the only room that draws.

Figures. The `board`, `chladni` figures, `constants`, `modes`, the `posterior`, a `corner_plot`, a `diagnosis` and
`planning` have theirs, in one `style`; `plots` draw them on request and `saving` writes them.

Pages. `page` is that of a fit, with its `content` and its `verdict`; a `campaign`, a `grading` and `recordings` have
their own.
"""
