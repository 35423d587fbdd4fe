"""One model in one process: its trees are built, its walks checked, then timed in rounds."""

from __future__ import annotations

from pathlib import Path

from rtbench.errors import WrongAnswers
from rtbench.experiments import tree_cells, tree_peers
from rtbench.experiments.peers import find
from rtbench.experiments.tree_cells import PEER, Built, Walk
from rtbench.measure.schedule import order
from rtbench.records import schema

SAMPLE_NS = 15_000_000  # a pass over the rays that is shorter is repeated
MOST_PASSES = 64
_OPTIONS = (
    *("axes", "candidates", "overlap", "traversal_cost", "intersection_cost", "max_leaf"),
    "block",
)


class OverModel:
    """A model in one process; the first process judges the answers and counts steps.

    Parameters
    ----------
    bench, scene, worker, process, writer, watcher, share
        What `rtbench.experiments.trees.measure` has at hand.
    """

    def __init__(self, bench, scene, worker, process, writer, watcher, share) -> None:
        self.bench, self.config, self.scene, self.worker = bench, bench.config, scene, worker
        self.process, self.writer, self.watcher, self.share = process, writer, watcher, share
        self.model, self.first = scene.model, process == 0
        self.trees: list[Built] = scene.trees

    def run(self, rounds: int) -> None:
        """Do all of it; rows are written round by round, tables grow in the bench."""
        name = self.model.name
        self.worker.ask("model", **self.model.message)
        self._build()
        self.share.done((name, "build"))
        walks, sizes = self._check()
        self.share.done((name, "check"))
        self.worker.ask("ready")
        for turn in range(rounds):
            self._round(turn, walks, sizes)
            self.share.done((name, turn))

    def _say(self, text: str) -> None:
        self.watcher.say(f"{self.model.name}, process {self.process + 1}: {text}")
        self.share.still()

    def _build(self) -> None:
        table = self.bench.tables[schema.TREES]
        for place, tree in enumerate(self.trees):
            self._say(f"building {' '.join(filter(None, tree.key.values()))}")
            found = self.worker.ask("build", options=tree.told, judged=self.first)
            if self.first:
                self.scene.__dict__.setdefault("made", {})[place] = found
                if found["leaf_sizes"]:
                    sizes = {"model": self.model.name, **tree.key, "sizes": found["leaf_sizes"]}
                    self.bench.facts.setdefault("leaf_sizes", []).append(sizes)
            known = self.scene.made[place]
            if known["digest"] != found["digest"]:
                raise WrongAnswers(
                    f"tree {' '.join(tree.key.values())} over {self.model.name} was built anew and "
                    f"is another: {found['digest']}, before {known['digest']}"
                )
            row = {name: tree.told[name] for name in _OPTIONS if name in tree.told}
            kept = {n: v for n, v in known["quality"].items() if n in schema.TREE_COLUMNS}
            table.append(
                kept
                | row
                | tree.key
                | {
                    "model": self.model.name,
                    "triangles": self.model.triangles,
                    "process": self.process,
                    "build_seconds": found["build_seconds"],
                    "build_cpu_seconds": found["build_cpu_seconds"],
                    "digest": found["digest"],
                }
            )
        self.peers = []
        for name in self.bench.peers:
            self._say(f"building {name}")
            found = self.worker.ask("peer", name=name)
            if "failed" in found:
                remark = f"peer {name} failed over {self.model.name}: {found['failed']}"
                self.writer.update(remarks=[remark])
                continue
            self.peers.append(name)
            row = {"structure": name, "model": self.model.name, "process": self.process}
            table.append(row | {"triangles": self.model.triangles} | found)

    def _check(self) -> tuple[list[Walk], list[dict]]:
        """Walk every cell once; return the cells and what was learnt of each."""
        if hasattr(self.scene, "walks_for_shadow"):
            one = self.scene.walks_for_shadow
            asked = {"kernel": one.kernel, "precision": one.precision, "way": one.way}
            shadows = self.worker.ask("shadow", tree=one.tree, **asked)["rays"]
        walks = [
            walk
            for walk in self._walks()
            if walk.rays != "shadow" or shadows  # none where primary rays hit nothing
        ]
        sizes, seen = [], {}
        for walk in walks:
            self._say(f"walking {walk.kernel} {walk.way}")
            most = self.config.naive if walk.tree is None else None
            most = tree_peers.limit(walk.kernel) if walk.way == PEER else most
            asked = {"kernel": walk.kernel, "precision": walk.precision, "tree": walk.tree}
            asked |= {"way": walk.way, "rays": walk.rays, "threads": walk.threads, "most": most}
            found = self.worker.ask("cell", **asked)
            self._must_agree(walk, found)
            sizes.append(found)
            if walk.way != PEER:
                seen.setdefault(walk.group, found)
        if self.first:
            self._judge(walks, seen)
        return walks, sizes

    def _walks(self) -> list[Walk]:
        """Return the cells, the peers' among them."""
        sets = self.model.ray_sets
        return self.scene.walks + [
            Walk(name, find(name).precision, None, PEER, rays)
            for name in self.peers
            for rays in sets
            if tree_peers.asks(name, rays)
        ]

    def _must_agree(self, walk: Walk, found: dict) -> None:
        if found["differ"]:
            told = " ".join(value for value in walk.key(self.trees).values() if value)
            rays, first = found["differ"]["rays"], found["differ"]["first"]
            raise WrongAnswers(
                f"{rays} rays over {self.model.name} get other answers by {told} than by the first "
                f"tree and way, the first is ray {first}"
            )

    def _judge(self, walks: list[Walk], seen: dict[tuple, dict]) -> None:
        table = self.bench.tables[schema.VISITS]
        config, images = self.config, Path(self.writer.path) / "images"
        pictured: set[str] = set()
        for walk in tree_cells.counted(self.trees, walks):
            if walk.kernel != self.bench.kernels[0].name or walk.precision != config.precisions[0]:
                continue
            tree = self.trees[walk.tree]
            image = None
            if walk.rays == "primary" and walk.way == "stack" and tree.rule not in pictured:
                pictured.add(tree.rule)
                image = str(images / f"{self.model.name.replace(':', '-')}-{tree.rule}.npz")
            self._say("counting steps")
            asked = {"kernel": walk.kernel, "precision": walk.precision, "tree": walk.tree}
            asked |= {"way": walk.way, "rays": walk.rays, "image": image}
            found = self.worker.ask("count", **asked)
            found["leaf_tests"] = found.pop("tests")
            asked = {"kernel": walk.kernel, "precision": walk.precision, "rays": walk.rays}
            more = {"model": self.model.name, "block": tree.options.block}
            table.append(found | asked | tree.key | more | {"hits": seen[walk.group]["hits"]})
        for kernel, precision, rays in seen:
            self._say(f"judging {kernel} in {precision}")
            asked = {"kernel": kernel, "precision": precision, "rays": rays}
            row = asked | {"model": self.model.name}
            found = self.worker.ask("brute", most=config.judged, **asked) if config.judged else {}
            first = found.pop("first", None)
            if found.get("wrong"):
                raise WrongAnswers(
                    f"{found['wrong']} of {found['rays_judged']} rays over {self.model.name} get "
                    f"other answers by {kernel} in {precision} in trees than by brute force, "
                    f"the first is ray {first} of {rays}"
                )
            if config.exact and rays != "shadow":
                found |= self.worker.ask("exact", most=config.exact, **asked)
            found |= self.worker.ask("never_hit", kernel=kernel)
            table.append(row | found | {"hits": seen[kernel, precision, rays]["hits"]})
        self._compare_peers()

    def _compare_peers(self) -> None:
        kernel, precision = self.bench.kernels[0].name, self.config.precisions[0]
        answers = self.bench.facts.setdefault("peer_answers", [])
        for name in self.peers:
            for rays in self.model.ray_sets:
                if tree_peers.asks(name, rays):
                    self._say(f"comparing with {name}")
                    asked = {"kernel": kernel, "precision": precision, "rays": rays}
                    found = self.worker.ask("compare", name=name, **asked)
                    key = {"model": self.model.name, "peer": name, "rays": rays, "kernel": kernel}
                    answers.append(key | found)

    def _round(self, turn: int, walks: list[Walk], sizes: list[dict]) -> None:
        rows = []
        for position, i in enumerate(order(self.config.seed, self.process, turn, len(walks))):
            walk, size = walks[i], sizes[i]
            passes = min(MOST_PASSES, max(1, SAMPLE_NS // max(1, size["ns"])))
            found = self.worker.ask("time", cell=i, repetitions=passes)
            self._must_agree(walk, found)
            rows.append(
                walk.key(self.trees)
                | {
                    "model": self.model.name,
                    "process": self.process,
                    "launch": 0,
                    "round": turn,
                    "position": position,
                    "triangles": self.model.triangles,
                    "repetitions": passes,
                    "tests": size["rays"] * passes,
                    "ns": found["ns"],
                    "cpu_ns": found["cpu_ns"],
                }
            )
            self._say(f"round {turn + 1}")
        self.writer.append(rows)
