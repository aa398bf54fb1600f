"""Which samplers are compared: how each is installed, run and judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["chain", "weighted"]
JAX = ("jax==0.10.2", "jaxlib==0.10.2", "numpy==2.4.6", "scipy==1.17.1")


@dataclass(frozen=True)
class Peer:
    """One sampler as its own documentation would have it run.

    Attributes
    ----------
    name : str
        Of the row; unique.
    module : str
        Of `benchmarks.peers`, run in a process of its own.
    environment : str
        Name of its environment, which peers may share.
    requirements : tuple of str
        `name==version`, all that the environment is given.
    imports : str
        What must be importable there.
    size : int
        Of the first trial run.
    largest : int
        Size beyond which it is given up.
    variant : str
        Passed on to the module.
    is_compiled : bool
        Whether a second run in the same process is faster.
    is_limit : bool
        Whether it is no peer but what none can pass.
    aside : str
        What the page says of how it is run.
    """

    name: str
    module: str
    environment: str
    requirements: tuple[str, ...]
    imports: str
    size: int
    largest: int
    variant: str = ""
    is_compiled: bool = False
    is_limit: bool = False
    aside: str = ""


NUMPY = ("emcee==3.1.6", "numpy==2.4.6", "scipy==1.17.1")
DYNESTY = ("dynesty==3.1.0", "numpy==2.4.6", "scipy==1.17.1")

PEERS = (
    Peer("emcee, stretch moves, vectorised", "with_emcee", "emcee", NUMPY, "emcee", 12_000, 200_000, "vectorised",
         aside="32 walkers from about the estimate"),
    Peer("emcee, stretch moves, a point at a time", "with_emcee", "emcee", NUMPY, "emcee", 12_000, 100_000,
         "one by one", aside="the same, `vectorize=False`"),
    Peer("probeye, its emcee solver", "with_probeye", "probeye",
         ("probeye==3.0.4", "emcee==3.1.6", "numpy==1.26.4", "scipy==1.17.1"), "probeye", 12_000, 60_000,
         aside="20 walkers from the prior, as the solver starts them; its Gaussian likelihood, which knows no "
         "rounding, exchanged for that of the intervals"),
    Peer("SMCPy, adaptive", "with_smcpy", "smcpy", ("smcpy==0.1.17", "numpy==2.4.6", "scipy==1.17.1"), "smcpy",
         4500, 100_000, aside="10 vectorised Metropolis steps a temperature; particles count as independent, which "
         "favours it"),
    Peer("dynesty, static", "with_dynesty", "dynesty", DYNESTY, "dynesty", 800, 6000, "static",
         aside="random walks, `dlogz` 0.01"),
    Peer("dynesty, dynamic, for the posterior alone", "with_dynesty", "dynesty", DYNESTY, "dynesty", 4500, 40_000,
         "dynamic", aside="random walks, all weight on the posterior"),
    Peer("NumPyro, NUTS", "with_numpyro", "numpyro", ("numpyro==0.22.0", *JAX), "numpyro", 1200, 40_000, "vectorized",
         is_compiled=True, aside="4 chains, `chain_method=\"vectorized\"`, 1000 steps of warm-up, double precision"),
    Peer("BlackJAX, NUTS", "with_blackjax", "blackjax", ("blackjax==1.7.1", *JAX), "blackjax", 3000, 100_000,
         is_compiled=True, aside="4 chains by `vmap`, window adaptation of 1000 steps, double precision"),
    Peer("limit: weighted independent draws, same posterior", "limits", "emcee", NUMPY, "scipy", 20_000, 200_000,
         "weighted", is_limit=True, aside="importance sampling tailored to this board with NumPy; needs the estimate"),
    Peer("limit: closed form at one noise", "limits", "emcee", NUMPY, "scipy", 4500, 10_000, "closed form",
         is_limit=True, aside="normal draws about the estimate: another posterior, shown for the time alone"),
)  # fmt: skip
