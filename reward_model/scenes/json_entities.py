"""The part common to both scene formats: ids of people and objects, and interactions between them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from reward_model.base.arrays import IntArray
from reward_model.scenes.json_fields import JsonField
from reward_model.scenes.scene import Interactions


class EntityIds:
    """The ids of one scene's people and objects, in order.

    Args:
        people, objects: lists of JSON objects with an `id` each

    Raises:
        ScenarioError: If an id is no integer or is used twice.
    """

    people: IntArray
    objects: IntArray

    def __init__(self, people: JsonField, objects: JsonField) -> None:
        self._places: dict[int, str] = {}
        self.people = self._add(people)
        self.objects = self._add(objects)
        self._object_ids = frozenset(self.objects.tolist())

    def interactions(self, links: Iterable[tuple[JsonField, JsonField, JsonField]]) -> Interactions:
        """Return the interactions given by triples of fields: one id, the other id, and the relation's name.

        A pair that is given twice or in both directions is kept once, with its first relation.

        Raises:
            ScenarioError: If an id is unknown, where both ids are the same, and where both are objects': the graph has
                no relation between objects.
        """
        relations: dict[tuple[int, int], str] = {}
        for first, second, relation in links:
            pair = (self._known(first), self._known(second))
            if pair[0] == pair[1]:
                raise second.refused("must differ from the other end of the interaction")
            if self._object_ids.issuperset(pair):
                raise second.refused("must be a person, the other end of the interaction is an object")
            name = relation.text()
            if pair[::-1] not in relations:
                relations.setdefault(pair, name)
        return Interactions(
            np.array(list(relations), dtype=np.int64).reshape(len(relations), 2), tuple(relations.values())
        )

    def _add(self, entities: JsonField) -> IntArray:
        ids = []
        for entity in entities.items():
            field = entity["id"]
            identity = field.integer()
            if (holder := self._places.get(identity)) is not None:
                raise field.refused(f"must differ from {holder}, ids of people and objects are unique")
            self._places[identity] = field.path
            ids.append(identity)
        return np.array(ids, dtype=np.int64)

    def _known(self, end: JsonField) -> int:
        identity = end.integer()
        if identity not in self._places:
            raise end.refused("must be the id of a person or an object in the scene")
        return identity
