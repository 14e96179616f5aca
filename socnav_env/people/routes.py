"""Routes of people in scenarios: one place after the other, then the ending."""

from __future__ import annotations

import numpy as np

from reward_model.base.arrays import BoolArray, FloatArray
from socnav_env.layout import Ending, Script
from socnav_env.people.social_force import ARRIVED, SLOW_DOWN
from socnav_env.people.walkers import Walkers


class Routes:
    """Sets the targets of walkers with a route; walkers without one, or at its end, choose their own.

    The members of a group have the same route, and a place is reached when the group's centre arrives. Walkers on a
    route do not give up a place because the way is blocked.

    Args:
        script: of the episode
        walks: (num_people,) whether each person walks; all other arrays here have one row per walker
    """

    def __init__(self, script: Script, walks: BoolArray) -> None:
        self._routes, self._delays = script.routes[walks], script.delays[walks]
        self._endings = script.endings[walks]
        self._lengths = (~np.isnan(self._routes[..., 0])).sum(axis=1)
        self._places = np.zeros(len(self._lengths), dtype=np.int64)
        self._following = self._lengths > 0

    def follow(self, walkers: Walkers, bodies: FloatArray, time: float) -> None:
        """Set the targets for the next control period.

        Args:
            bodies: (num_walkers or more, 2 or more) x, y of the walkers
            time: since the start [s]
        """
        for walker in np.flatnonzero(self._following).tolist():
            members = walkers.group == walkers.group[walker]
            middle = bodies[: len(members)][members, :2].mean(axis=0)
            waits = time < self._delays[walker]
            if not waits:
                self._go_on(walker, middle)
            walkers.target[walker] = middle if waits else self._routes[walker, self._places[walker]]
            walkers.time_left[walker] = np.inf if self._following[walker] else 0.0
            walkers.blocked[walker] = 0.0

    def _go_on(self, walker: int, middle: FloatArray) -> None:
        """Move on to the next place once this one is near; only the last one is walked up to."""
        place, last = self._places[walker], self._lengths[walker] - 1
        ending = self._endings[walker]
        reach = ARRIVED if place == last and ending != Ending.REPEAT else SLOW_DOWN
        if np.hypot(*(self._routes[walker, place] - middle)) >= reach:
            return
        if place < last:
            self._places[walker] += 1
        elif ending == Ending.REPEAT:
            self._places[walker] = 0
        elif ending == Ending.WANDER:
            self._following[walker] = False
