"""The observation `graph`: the reward model's input, as an agent's observation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from gymnasium import spaces

from reward_model.base.arrays import Float32Array, IntArray
from reward_model.graph.features import NUM_FRAMES, NUM_NODE_FEATURES, NUM_RELATIONS, NodeKind, Relation
from reward_model.graph.frame import FrameGraph
from reward_model.graph.packing import FrameArrays
from reward_model.graph.windows import scene_graph, wall_segments
from socnav_env.observations.base import ROBOT, SHARE, Parts
from socnav_env.observations.kernels import write_robot

if TYPE_CHECKING:
    from socnav_env.config import EnvConfig, RoomConfig
    from socnav_env.simulation.world import World

WALL_LINKS: Final = 10  # wall segments near a person, more than in any room
BOUND: Final = 100.0  # far above every feature and length
WALL_RELATIONS: Final = (Relation.PERSON_WALL, Relation.WALL_PERSON)


class GraphObservation:
    """The reward model's own graph of the last two seconds, padded, as a flat `Dict` of float32 boxes.

    nodes (capacity * 42,): rows of features as `reward_model.graph` has them, the newest frame's room node first
    nodes_mask (capacity,): 1 where there is a node
    sources, targets (capacity,): rows of `nodes` that an edge joins; relations: of `Relation`; lengths: as the network
        reads them. All edges are included, also those to the room, to the node itself and through time.
    edges_mask (capacity,): 1 where there is an edge
    robot (4,): as in `EntitiesObservation`

    Capacities follow from the config: `max_nodes` of a frame and `max_links` between its people, objects and walls.
    In a layout from elsewhere that has more, the nearest nodes and the shortest links are observed.
    """

    def __init__(self, config: EnvConfig) -> None:
        population = config.population
        self.max_nodes = 2 + population.max_people + population.max_objects + most_segments(config.room)
        self.max_links = 2 * (population.max_interactions + WALL_LINKS * population.max_people)
        nodes = NUM_FRAMES * self.max_nodes
        frame_edges = 3 * self.max_nodes - 2 + self.max_links  # to and from the room, to itself, links
        edges = NUM_FRAMES * frame_edges + (NUM_FRAMES - 1) * 2 * self.max_nodes
        index = [(0.0, nodes - 1.0)] * edges
        self._parts = Parts(
            {
                "robot": ROBOT,
                "nodes": [(-BOUND, BOUND)] * (nodes * NUM_NODE_FEATURES),
                "nodes_mask": SHARE * nodes,
                "sources": index,
                "targets": index,
                "relations": [(0.0, NUM_RELATIONS - 1.0)] * edges,
                "lengths": [(0.0, BOUND)] * edges,
                "edges_mask": SHARE * edges,
            }
        )

    def space(self) -> spaces.Dict:
        """Return the boxes."""
        return self._parts.space()

    def observe_window(self, world: World, time_left: float, window: Sequence[FrameGraph]) -> dict[str, Float32Array]:
        """Return the boxes' values in new arrays."""
        graph = scene_graph(fitted_frames(window, self.max_nodes, self.max_links))
        row = np.zeros(self._parts.size, dtype=np.float32)
        parts = self._parts.split(row)
        write_robot(parts["robot"], world.state.robot_pose, world.state.robot_velocity, time_left)
        parts["nodes"][: graph.features.size] = graph.features.ravel()
        parts["nodes_mask"][: len(graph.features)] = 1.0
        for name in ("sources", "targets", "relations", "lengths"):
            parts[name][: len(graph.sources)] = getattr(graph, name)
        parts["edges_mask"][: len(graph.sources)] = 1.0
        self._parts.clip(row)
        return parts


def most_segments(room: RoomConfig) -> int:
    """The maximum number of wall segments in a room that the config allows."""
    sides = [[float(side)] * 4 for side in (room.square_side[1], room.rectangle_side[1])]
    sides.append([float(room.l_unit[1] * units) for units in (3, 3, 2, 2, 1, 1)])
    walls = [np.array([[0.0, 0.0, length, 0.0] for length in lengths]) for lengths in sides]
    return max(int(wall_segments(each).sum()) for each in walls)


def fitted_frames(window: Sequence[FrameGraph], max_nodes: int, max_links: int) -> list[FrameGraph]:
    """The frames of a window, newest first, each with at most `max_nodes` nodes and `max_links` links."""
    frames = list(window)
    if max(len(frame) for frame in frames) > max_nodes:
        newest = window[0].arrays
        nearness = np.where(newest.kinds == NodeKind.GOAL, 0.0, newest.lengths)
        kept = newest.keys[np.argsort(nearness, kind="stable")[:max_nodes]]
        frames = [_with_nodes(frame, kept) for frame in frames]
    return [_with_links(frame, max_links) if frame.num_links > max_links else frame for frame in frames]


def _with_nodes(frame: FrameGraph, keys: IntArray) -> FrameGraph:
    """The frame with only the nodes that have one of the keys, and the links among them."""
    arrays = frame.arrays
    kept = np.isin(arrays.keys, keys)
    new_index = (np.cumsum(kept) - 1).astype(np.int32)
    arrays = _chosen_links(arrays, np.flatnonzero(kept[arrays.link_sources] & kept[arrays.link_targets]))
    return FrameGraph(
        *arrays._replace(
            features=arrays.features[kept],
            kinds=arrays.kinds[kept],
            keys=arrays.keys[kept],
            lengths=arrays.lengths[kept],
            link_sources=new_index[arrays.link_sources],
            link_targets=new_index[arrays.link_targets],
        )
    )


def _with_links(frame: FrameGraph, max_links: int) -> FrameGraph:
    """The frame with at most `max_links` links: all interactions, then the shortest ones between people and walls."""
    arrays = frame.arrays
    walls = np.isin(arrays.link_relations, WALL_RELATIONS)
    order = np.lexsort((arrays.link_lengths, walls))
    return FrameGraph(*_chosen_links(arrays, np.sort(order[:max_links])))


def _chosen_links(arrays: FrameArrays, chosen: IntArray) -> FrameArrays:
    return arrays._replace(
        link_sources=arrays.link_sources[chosen],
        link_targets=arrays.link_targets[chosen],
        link_relations=arrays.link_relations[chosen],
        link_lengths=arrays.link_lengths[chosen],
    )
