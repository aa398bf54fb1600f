"""What was changed before this run of the trial, as lines of its page: a sentence at its head, the rest at its end."""

from __future__ import annotations

BEFORE = (
    "All boards are new: the run before this one missed 22 of 85 limits, and a rule of `diagnose` was mended after it, "
    "before any board of this run was planted ([history](#history))."
)

CHANGED: tuple[str, ...] = (
    "## History",
    "",
    "The run before this one (base seed 7, as many boards, of 24 November) missed 22 of 85 limits. Cells and sizes are "
    "as they were, and two limits joined, of boards outside the library that are named at least in part. Since then:",
    "",
    "- All boards are new: base seed 9.",
    "- The library has grown: a board that is not flat (warp) and an exciter are candidates too.",
    "- With them noise was named more often: half a run of the boards of seed 7 was judged again and looked at. An "
    "effect is needed since only from odds of three to one against *no effect*, whatever the simulated boards without "
    "any say.",
    "- Of what the library does not know, a glued rib is taken for warp: both stiffen the lowest modes. No rule was "
    "mended for it.",
    "",
    "The boards were judged in several sittings on one tree. One board of every cell was judged again on the tree "
    "that this page names, and came out as it had: the same verdict and claim, probabilities alike to 0.001.",
    "",
    "The run of seed 7 had followed one that missed 36 limits (base seed 6). Two rules were mended between them. The "
    "p-value of the misfit had been averaged over levels of the noise, each with a misfit of its own, so that boards "
    "of two setups that lack nothing were called unexplained too often; it is the share of readings, simulated from "
    "the priors, that the model expects as little. And of the wrong names a third were claimed: a fifth condition of "
    "the claim asks that the probability of another effect than those told stays below 0.05. How often boards that "
    "lack nothing may be flagged had been asked as at most 5 %, which a gate that flags 5 % of them by design could "
    "not meet; it is asked whether more are flagged than the rules flag by design.",
    "",
    "Runs before had changed, in this order: the grain is planted at most five degrees off, for six is where its"
    " prior ends; the card of the clamped board calls its sensor a shaker; modes are followed by their shapes, "
    "not by their ranks, where an effect breaks the symmetry; the planted sensor has the rotary inertia that the "
    "card promises; a Poisson ratio is not planted on a board clamped all round, where it leaves no visible "
    "trace; cells of size 2x at 5 cents were made three times as large. Then null cells were added in which the true "
    "noise is drawn from its prior, is known, or readings are rounded; a stiffness gradient joined the library; an "
    "effect is needed at a false-alarm rate of 2 % and named only if the name survives other priors, another noise and "
    "the exact law; the most probable answer may be that nothing is lacking, and limits count all classes.",
)
