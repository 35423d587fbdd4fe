"""Hard cases with exact answers: the corpus, its families, and one curve over |dir|."""

from rtbench.workloads.hard_cases.assembling import VERSION, corpus, describe, drawn
from rtbench.workloads.hard_cases.families import CORE, FAMILIES, Family
from rtbench.workloads.hard_cases.magnitudes import direction_lengths

__all__ = [
    "CORE",
    "FAMILIES",
    "VERSION",
    "Family",
    "corpus",
    "describe",
    "direction_lengths",
    "drawn",
]
