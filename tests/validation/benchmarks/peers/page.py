"""The page of the peers: one table, what is ahead of the package, and what could not be had."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from validation.benchmarks.peers.package import COMMANDS
from validation.benchmarks.peers.registry import Peer
from validation.benchmarks.peers.trials import Result

AGREES = 4.0
"""Monte Carlo standard errors, the largest of eight moments: beyond, the posterior is another one."""

HEAD = """# Beside other samplers

Written by `make peers`; do not edit. One posterior, that of `{board}` under the linear law: four parameters, six
frequencies read to 1 Hz, each the probability of the interval that was rounded to it. Every sampler is given the same
file of coefficients, priors and readings, and the estimate to start from, which the package has to find first. Each
has an environment and a process of its own, on one thread. The peers evaluate a density in NumPy or JAX that was
written for this comparison; the benchmarks, on a page of their own, give emcee the package's own posterior.

- Cold time: a whole process, from its start to its exit, with draws in a file, that ends with at least
  {goal:,} effective draws of the parameter that has fewest. The length of the run is told to every peer; it was found
  by trials that do not count. The package is told nothing: it stops by its own rule, judges convergence, and writes
  its summary and archive (and, without `--no-report`, its page of figures).
- Effective draws: of chains by the package's autocorrelation time, at least one draw, for all alike; of weighted ones
  by the size of Kish. Per second after imports and set-up: warm-up and judgements of convergence count, compilation
  does not and stands apart (in the cold time it is).
- Off: the largest difference from quadrature of four means, and of four standard deviations, in Monte Carlo standard
  errors of {seeds} runs together. Up to {agrees:g} counts as the same posterior.
- Medians of {seeds} seeds. Ratios are the peer's number over that of `{base}`.

| sampler | cold time, s | ratio | effective draws per s | ratio | compilation, s | effective draws | off: means, sds |
|---|---:|---:|---:|---:|---:|---:|---:|
"""


def page(
    results: Sequence[Result], peers: Sequence[Peer], about: Mapping[str, object], board: str, goal: int, n_seeds: int
) -> str:
    """The text of the page, from the package's results and those of its peers, skipped ones included."""
    base_name = next(iter(COMMANDS))
    by_name = {result.name: result for result in results}
    base = by_name[base_name]
    shown = [result for result in results if not result.missing]
    parts = [
        HEAD.format(board=board, goal=goal, agrees=AGREES, seeds=n_seeds, base=base_name)
        + "\n".join(row(result, base) for result in shown),
        "\n".join(ahead([by_name[peer.name] for peer in peers if peer.name in by_name], peers, base)),
    ]
    others = [sentence for result in shown if (sentence := other_posterior(result))]
    missing = [f"- {result.name}: not measured; {result.missing}." for result in results if result.missing]
    sections = {"Other posteriors": others, "Not measured": missing}
    parts += [f"## {title}\n\n" + "\n".join(lines) for title, lines in sections.items() if lines]
    how = [f"- {peer.name}: {peer.aside}." for peer in peers if peer.aside and by_name.get(peer.name) in shown]
    parts.append("## How each was run\n\n" + "\n".join(how))
    versions = sorted({one for result in shown for one in result.versions.split(", ") if one})
    facts = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in about.items())
    parts.append(f"Measured with {facts}.\nIn the environments of the peers: {', '.join(versions)}.")
    return "\n\n".join(part for part in parts if part) + "\n"


def row(result: Result, base: Result) -> str:
    """The row of one sampler."""
    off = result.difference
    cells = (
        f"`{result.name}`" if result.name in COMMANDS else result.name,
        f"{result.cold_time:.3g}",
        f"{result.cold_time / base.cold_time:.3g}",
        f"{result.rate:,.3g}" if result.rate < 1000 else f"{result.rate:,.0f}",
        f"{result.rate / base.rate:.3g}",
        f"{result.compilation:.3g}" if result.warm else "",
        f"{min(result.ess):,.0f}",
        f"{off['mean']:.1f}, {off['sd']:.1f}",
    )
    return f"| {' | '.join(cells)} |"


def ahead(results: Sequence[Result], peers: Sequence[Peer], base: Result) -> list[str]:
    """Sentences that say which peers are faster than the package, cold and warm; one says so if none is."""
    limits = {peer.name for peer in peers if peer.is_limit}
    compiled = {peer.name for peer in peers if peer.is_compiled}
    found = [result for result in results if not result.missing and result.name not in limits]
    colder = [result.name for result in found if result.cold_time < base.cold_time]
    lines = [f"Ahead of the package from a cold process: {_joined(colder)}."]
    for what, kept in (("that compile nothing", False), ("that are compiled, once they are", True)):
        faster = [r.name for r in found if (r.name in compiled) is kept and r.rate > base.rate]
        lines.append(f"Ahead of it in effective draws per second, of the peers {what}: {_joined(faster)}.")
    return lines


def other_posterior(result: Result) -> str:
    """What a sampler's posterior differs by; empty if it is the same within its Monte Carlo error."""
    off = result.difference
    if max(off["mean"], off["sd"]) <= AGREES:
        return ""
    return (
        f"- {result.name}: a mean differs by {off['mean_share']:.2f} posterior standard deviations, a standard "
        f"deviation by {100 * off['sd_share']:.0f} %."
    )


def _joined(names: Sequence[str]) -> str:
    return "; ".join(names) if names else "none"
