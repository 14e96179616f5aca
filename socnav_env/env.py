"""`SocNavEnv`, the environment behind `gym.make("SocNav2-v0")`: it connects the parts, nothing else."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from reward_model.base.arrays import FloatArray
from reward_model.scenes.scene import Scores
from socnav_env.config import EnvConfig
from socnav_env.episode import Episode, begin_episode
from socnav_env.metrics import episode_metrics
from socnav_env.observations import AnyObservation, Observation, WindowObservation, make_observation
from socnav_env.rewards import Moment, Reward, make_reward, weighted_terms
from socnav_env.rewards.judging import judge
from socnav_env.scenarios import Scenario, load_scenario
from socnav_env.simulation.actions import action_of as action_of
from socnav_env.simulation.actions import action_space, command_of
from socnav_env.trajectories.outcomes import Outcome

if TYPE_CHECKING:
    from reward_model.graph.frame import FrameGraph
    from socnav_env.rendering import Controls, Renderer
    from socnav_env.rendering.view import HeatOverlay, SceneView
    from socnav_env.simulation.world import World
    from socnav_env.trajectories.trajectory import Trajectory

SHOWN_PER_SECOND = 60  # pictures in the window, interpolated between two steps


class StepResult(NamedTuple):
    """The results of a step besides the observation; see Gymnasium."""

    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]


class SocNavEnv(gym.Env[Any, NDArray[np.float32]]):
    """A robot crosses a room among people and is rewarded for doing so in a way they find acceptable.

    Action: `Box(-1, 1, (2,))`, forward and turn, as shares of the robot's top speeds; for a holonomic robot
    `Box(-1, 1, (3,))`, forward, left and turn. Negative forward drives backwards, positive turn is to the left.
    Values outside the box are clipped to it; forward and left together then have a length of at most 1.

    Observation: by name, see `socnav_env.observations`; "entities" is a `Dict` of flat boxes in the robot's frame,
    "flat" a single box, "lidar" has a laser scanner, "graph" is the reward model's input.

    Reward: by name, see `socnav_env.rewards`; "learned" is the network's Q2 - 1 for every second, with terminal terms
    for arriving and for touching something.

    Termination: the robot arrived, or touched a person, an object or a wall.

    Truncation: `config.time_limit` is reached. There is no other time limit.

    Start: a room drawn with the generator that `reset(seed=)` seeds, after a warm-up in which the robot stands; or a
    scenario, whose ranges are drawn with the same generator.

    Info, every step: `outcome` (None, "arrived", "collision_person", "collision_object", "collision_wall" or
    "timeout"), `is_success`, `in_rated_range` (whether people rated such a robot as is judged: with its
    speeds divided by `config.reward.time_scale`), `reward_terms` (each term's contribution; their sum is the reward),
    `reward_weights`, and with a learned reward `q1` and `q2`, the raw scores of the last second, slowed by that factor,
    `q1_std` and `q2_std`, their standard deviations over the network's members, and `in_range`, whether the scene is
    like those that the network was trained on. In an episode's last step also `episode_metrics`, see
    `socnav_env.metrics`. After a reset: `outcome`, `is_success` and `in_rated_range`.

    Versions: v0, the first one.

    Args:
        reward: a name, a mix (see `make_reward`), or an object with the `Reward` protocol
        observation: a name or an object with the `Observation` (or `WindowObservation`) protocol
        config: all other settings; default `EnvConfig()`
        render_mode: None, "rgb_array" or "human"
        weights: the network of a learned reward that is given by name: "default", "published" or a path
        scenario: a name of `socnav_env.scenarios.names()`, a .yaml file, or a SocNav2 .json file to continue; its own
            settings take precedence over `config`. None: rooms and people drawn as in `config`
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 5}  # noqa: RUF012 - as Gymnasium

    def __init__(
        self,
        reward: str | Mapping[str, float] | Reward = "learned",
        observation: str | AnyObservation = "entities",
        config: EnvConfig | None = None,
        render_mode: str | None = None,
        weights: str = "default",
        scenario: str | os.PathLike[str] | Scenario | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            valid = ", ".join(self.metadata["render_modes"])
            raise ValueError(f"render_mode must be None or one of {valid}, got {render_mode!r}")
        self.scenario = None if scenario is None else load_scenario(scenario)
        self.config = _config_of(config, self.scenario)
        self.reward = make_reward(reward, self.config.reward, weights)
        self.observation = make_observation(observation, self.config)
        self._reads_window = isinstance(self.observation, WindowObservation)
        self.observation_space = self.observation.space()
        self.action_space = action_space(self.config.robot)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": 1 / self.config.control_period}
        self._in_rated_range = self.config.in_rated_range
        self._episode: Episode | None = None
        self._renderer: Renderer | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Draw a new scene; see Gymnasium. There are no options."""
        check_options(options)
        info = self.begin(seed)
        return self.observe(), info

    def begin(self, seed: int | None = None) -> dict[str, Any]:
        """Reset without an observation: draw a new scene and return the info."""
        super().reset(seed=seed)
        judged = self.reward.scorer is not None
        self._episode = begin_episode(self.config, self.np_random, judged, self.scenario, self._reads_window)
        if self.render_mode == "human":
            self.render()
        return self._outcome_info(None)

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control period; see Gymnasium.

        Raises:
            ValueError: For an action that is not finite numbers of its shape.
            ResetNeeded: After the end.
        """
        self.require_running()
        self.advance(command_of(action, self.config.robot))
        result = self.conclude(judge(self.reward.scorer, self.window()))
        return self.observe(), *result

    def observe(self) -> Any:
        """Return the current observation in new arrays."""
        if self._reads_window:
            window = self._scene().observed_window()
            return cast(WindowObservation, self.observation).observe_window(self.world, self.time_left, window)
        return cast(Observation, self.observation).observe(self.world, self.time_left)

    def require_running(self) -> None:
        """Raise `ResetNeeded` where there is no running episode."""
        outcome = self._scene().outcome
        if outcome is not None:
            raise gym.error.ResetNeeded(f"the episode has ended ({outcome}), call reset()")

    def advance(self, command: FloatArray) -> None:
        """Begin a step: advance by one control period with a command as returned by `command_of`."""
        self._scene().advance(command)

    def window(self) -> list[FrameGraph]:
        """The frames scored for the last second, newest first."""
        return self._scene().window()

    def conclude(self, scores: Scores | None) -> StepResult:
        """End a step with the scores of the last second; return its reward, whether the episode ended, and the info."""
        episode = self._scene()
        moment = episode.conclude(scores)
        terms = weighted_terms(self.reward, moment)
        truncated = moment.outcome is Outcome.TIMEOUT
        terminated = moment.outcome is not None and not truncated
        if self.render_mode == "human":
            self._show(episode.recent_views(SHOWN_PER_SECOND))
        return StepResult(float(sum(terms.values())), terminated, truncated, self._info(episode, moment, terms))

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture, uint8 (height, width, 3), or show it, as `render_mode` says.

        The window shows every step by itself, in real time. There h draws the learned reward's heatmap under the
        scene, and p draws personal space.
        """
        if self.render_mode is None:
            gym.logger.warn('render() needs gym.make("SocNav2-v0", render_mode="rgb_array" or "human")')
            return None
        if self.render_mode == "rgb_array":
            return self.frame()
        self._show([self._scene().view()])
        return None

    def frame(self, heatmap: bool = False, rings: bool = False) -> NDArray[np.uint8]:
        """Return a picture of the scene as it is now, uint8 (height, width, 3), whatever the render mode.

        Args:
            heatmap: with Q2 of all the robot's positions under the scene; raises `ValueError` without a scorer
            rings: with everyone's intimate and personal space
        """
        heat = self._heat() if heatmap else None
        return self._drawing().draw(replace(self._scene().view(), heat=heat, rings=rings))

    @property
    def controls(self) -> Controls:
        """The input of the window; see `Controls`."""
        return self._drawing().controls

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    @property
    def world(self) -> World:
        """The episode's world, read-only."""
        return self._scene().world

    @property
    def has_scene(self) -> bool:
        """Whether the environment has been reset."""
        return self._episode is not None

    @property
    def time_left(self) -> float:
        """Remaining share of the episode's time, 0..1."""
        return self._scene().time_left

    @property
    def trajectory(self) -> Trajectory:
        """The trajectory since the episode began."""
        return self._scene().trajectory()

    def _scene(self) -> Episode:
        if self._episode is None:
            raise gym.error.ResetNeeded("there is no scene yet, call reset() first")
        return self._episode

    def _show(self, views: Sequence[SceneView]) -> None:
        """Show pictures in the window, one after the other in real time."""
        drawing = self._drawing()
        heat = self._heat() if drawing.controls.heatmap and self.reward.scorer is not None else None
        for view in views:
            drawing.show(replace(view, heat=heat, rings=drawing.controls.rings), SHOWN_PER_SECOND)

    def _heat(self) -> HeatOverlay:
        scorer, sequence = self.reward.scorer, self._scene().recent_sequence()
        if scorer is None or sequence is None:
            raise ValueError("a heatmap needs a learned reward, this one has no scorer")
        from socnav_env.rendering.heat_overlay import heat_of

        return heat_of(scorer, sequence, self.world.layout.room)

    def _drawing(self) -> Renderer:
        if self._renderer is None:
            from socnav_env.rendering import Renderer  # loads pygame

            self._renderer = Renderer()
        return self._renderer

    def _outcome_info(self, outcome: Outcome | None) -> dict[str, Any]:
        return {
            "outcome": None if outcome is None else outcome.value,
            "is_success": outcome is Outcome.ARRIVED,
            "in_rated_range": self._in_rated_range,
        }

    def _info(self, episode: Episode, moment: Moment, terms: dict[str, float]) -> dict[str, Any]:
        info = self._outcome_info(moment.outcome)
        info["reward_terms"] = terms
        info["reward_weights"] = dict(self.reward.weights)
        if moment.scores is not None:
            info["q1"], info["q2"], info["q1_std"], info["q2_std"], info["in_range"] = moment.scores
        if moment.outcome is not None:
            info["episode_metrics"] = episode_metrics(episode.trajectory())
        return info


def _config_of(config: EnvConfig | None, scenario: Scenario | None) -> EnvConfig:
    """The configuration with the scenario's settings. Raises `ConfigError` where its scene cannot be drawn."""
    wanted = EnvConfig() if config is None else config
    if scenario is None:
        return wanted
    adapted = scenario.adapt(wanted)
    scenario.draw(adapted, np.random.default_rng(0))
    return adapted


def check_options(options: dict[str, Any] | None) -> None:
    """Raise `ValueError` where `reset` got options: there are none."""
    if options:
        raise ValueError(f"reset has no options, got {', '.join(map(str, options))}; use config= of gym.make")
