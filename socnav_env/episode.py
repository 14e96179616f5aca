"""One episode: a simulated world and its record. No Gymnasium here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reward_model.base.arrays import FloatArray
from reward_model.graph.frame import FrameGraph
from reward_model.scenes.scene import SceneSequence, Scores
from reward_model.scenes.time_scale import slowed
from socnav_env.config import ConfigError, EnvConfig
from socnav_env.rendering.playback import view_at, view_of
from socnav_env.rendering.view import SceneView
from socnav_env.rewards import Moment
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.snapshots import Recorder
from socnav_env.simulation.world import World
from socnav_env.trajectories.outcomes import Outcome, decide_outcome
from socnav_env.trajectories.trajectory import Trajectory, TrajectoryRecorder

if TYPE_CHECKING:
    from socnav_env.scenarios import Scenario

MAX_STARTS = 20  # scenes drawn until one survives its warm-up
STANDING = np.zeros(3)  # command: forward speed, speed to the left, turn rate


class Episode:
    """An episode from the warm-up, simulated on construction, to the outcome.

    Args:
        judged: whether frames are kept for a scorer, slowed as the configuration says
        observed: whether frames are kept for an observation, in real time
    """

    def __init__(self, world: World, config: EnvConfig, judged: bool, observed: bool = False) -> None:
        self.world = world
        self.outcome: Outcome | None = None
        self.scores: Scores | None = None
        self._config = config
        period, time_scale = config.control_period, config.reward.time_scale
        self._recorder = Recorder(world, period, time_scale) if judged else None
        self._observed = self._recorder if time_scale == 1 else None  # the same frames serve both
        if observed and self._observed is None:
            self._observed = Recorder(world, period)
        self._recorders = [each for each in dict.fromkeys([self._recorder, self._observed]) if each is not None]
        for _ in range(config.warm_up_steps):
            self._advance_world(STANDING)
        self._trajectory = TrajectoryRecorder(world, config)
        self._goal_distance = world.distance_to_goal()

    @property
    def steps(self) -> int:
        """The number of finished steps."""
        return len(self._trajectory)

    @property
    def time_left(self) -> float:
        """Remaining share of the episode's time, 0..1."""
        return 1.0 - self.steps / self._config.max_steps

    def advance(self, command: FloatArray) -> None:
        """Advance by one control period with a command, see `World.advance`."""
        self._advance_world(command)
        self.outcome = decide_outcome(self.world, self._config.max_steps - self.steps - 1)

    def window(self) -> list[FrameGraph]:
        """The frames scored for the last second, newest first; without a scorer the observed ones."""
        return self.observed_window() if self._recorder is None else self._recorder.window()

    def observed_window(self) -> list[FrameGraph]:
        """The frames of the last second in real time, newest first; empty where nothing reads them."""
        return [] if self._observed is None else self._observed.window()

    def conclude(self, scores: Scores | None) -> Moment:
        """Record the last step with its scores and return its result."""
        earlier, self._goal_distance = self._goal_distance, self.world.distance_to_goal()
        progress = earlier - self._goal_distance
        self.scores = scores
        self._trajectory.record(scores)
        return Moment(self.world, self._config.control_period, progress, self.outcome, scores)

    def trajectory(self) -> Trajectory:
        """The trajectory since the warm-up."""
        return self._trajectory.trajectory(self.outcome)

    def view(self) -> SceneView:
        """The view of this moment."""
        return view_of(self.trajectory(), self.steps, self._config)

    def recent_views(self, per_second: float) -> list[SceneView]:
        """Views of the last step; at the start, of this moment."""
        trajectory, period = self.trajectory(), self._config.control_period
        count = max(round(per_second * period), 1) if self.steps else 1
        times = (self.steps - np.arange(count - 1, -1, -1) / count) * period
        return [view_at(trajectory, float(time), self._config) for time in times]

    def recent_sequence(self) -> SceneSequence | None:
        """The last two seconds as the scene that is scored; None without a scorer."""
        if self._recorder is None:
            return None
        return slowed(SceneSequence(self._recorder.snapshots, name="episode"), self._config.reward.time_scale)

    def _advance_world(self, command: FloatArray) -> None:
        self.world.advance(command)
        for recorder in self._recorders:
            recorder.record()


def begin_episode(
    config: EnvConfig,
    random: np.random.Generator,
    judged: bool,
    scenario: Scenario | None = None,
    observed: bool = False,
) -> Episode:
    """Draw a scene and simulate its warm-up; a scene that is over at its start is drawn anew.

    That can happen if people do not stop (`people.stop_distance` 0) and walk into the standing robot.

    Args:
        judged, observed: see `Episode`
        scenario: to draw it from; None: the population in `config`

    Raises:
        ConfigError: If it happens every time.
    """
    draw = sample_layout if scenario is None else scenario.draw
    for _ in range(MAX_STARTS):
        episode = Episode(World(draw(config, random), config, random), config, judged, observed)
        if decide_outcome(episode.world, steps_left=1) is None:
            return episode
    raise ConfigError(
        f"warm_up must leave the robot untouched, got {config.warm_up} s in which people touched it in "
        f"{MAX_STARTS} scenes in a row; ask for less warm-up or fewer wandering people"
    )
