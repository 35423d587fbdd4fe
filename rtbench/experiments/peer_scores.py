"""How libraries stand among the kernels on hard cases: what they get wrong, miss and hit twice."""

from __future__ import annotations

import numpy as np

from rtbench.accuracy.cases import Cases
from rtbench.accuracy.scoring import Scored, clipped, seen_in, tally
from rtbench.experiments import peers
from rtbench.experiments.checking import ask_kernel
from rtbench.experiments.peers import Peer
from rtbench.kernels.contract import Kernel

COUNTED = ("decided", "wrong", "unstable", "leaks", "groups", "doubles", "permutation")
NUMBERS = ("c_star", "p99_t", "p99_u", "p99_v")


def scored_kernel(kernel: Kernel, precision: str, cases: Cases) -> dict[str, object]:
    """Return how a kernel stands in the table of peers: columns of schema.PEER_COLUMNS."""
    seen = seen_in(cases, precision)
    answered = ask_kernel(kernel, precision, seen.triangles, seen.org, seen.dir)
    return {"kernel": kernel.name, "precision": precision} | _row(Scored(seen, answered, precision))


def scored_peer(peer: Peer, cases: Cases) -> dict[str, object]:
    """Return what a peer says of the hard cases, a scene a triangle, and of groups, a scene each.

    Returns
    -------
    dict
        Columns of schema.PEER_COLUMNS; ``scene_leaks``: groups of triangles that no ray may slip
        through, of which none is hit where all are in one scene.
    """
    seen = seen_in(cases, peer.precision)
    found = peers.peer_answers(peer, seen)
    t, u, v = (None if np.isnan(x[found.hit]).all() else x for x in (found.t, found.u, found.v))
    row = {"kernel": peer.name, "peer": peer.version, "precision": peer.precision}
    row |= _row(Scored(seen, clipped(found.hit, t, u, v), peer.precision))
    _, met = peers.groups_met(peer, seen)
    return row | {"scene_leaks": int(np.count_nonzero(~met)), "refused": found.refused}


def _row(scored: Scored) -> dict[str, object]:
    core = tally(scored)
    everything = tally(scored, np.ones(len(scored.cases), dtype=bool))
    row = {key: core[key] for key in (*COUNTED, *NUMBERS)}
    return row | {"invalid_accepted": everything["accepted"]}
