"""Measures of a recorded episode, each a pure function of a `Trajectory`.

Each function names its source. "Distance" is between surfaces (centre distance minus both radii) unless a function
says centre. A step is measured at the state after it, so that an episode of n steps has n values; the start, row 0,
counts only where something changes from it. A measure that has no meaning in an episode (the distance to people
in a room without any, the time to the goal if it was not reached), or that the recording does not allow, is NaN.

May import `trajectories` and what that is built of.
"""

from __future__ import annotations

from collections.abc import Callable

from socnav_env.metrics.disturbance import person_delay, person_detour
from socnav_env.metrics.interactions import group_intrusion, interaction_crossings, interaction_time
from socnav_env.metrics.learned import (
    q1_mean,
    q1_minimum,
    q1_share_below_acceptable,
    q2_mean,
    q2_minimum,
    q2_share_below_acceptable,
)
from socnav_env.metrics.motion import (
    failure_to_progress,
    heading_change,
    max_acceleration,
    max_jerk,
    max_speed,
    mean_acceleration,
    mean_jerk,
    mean_speed,
    path_irregularity,
    time_not_moving,
)
from socnav_env.metrics.outcomes import (
    collision_object,
    collision_person,
    collision_wall,
    path_length,
    spl,
    stl,
    success,
    time_to_goal,
    timeout,
)
from socnav_env.metrics.people import (
    discomfort_distance,
    discomfort_rate,
    intimate_zone,
    intrusion_distance,
    intrusion_ratio,
    mean_min_person_distance,
    min_person_distance,
    min_time_to_collision,
    personal_zone,
    social_zone,
)
from socnav_env.trajectories.trajectory import Trajectory

METRICS: dict[str, Callable[[Trajectory], float]] = {
    metric.__name__: metric
    for metric in (
        success,
        timeout,
        collision_person,
        collision_object,
        collision_wall,
        time_to_goal,
        path_length,
        spl,
        stl,
        min_person_distance,
        mean_min_person_distance,
        intimate_zone,
        personal_zone,
        social_zone,
        discomfort_rate,
        discomfort_distance,
        intrusion_ratio,
        intrusion_distance,
        interaction_crossings,
        interaction_time,
        group_intrusion,
        min_time_to_collision,
        mean_speed,
        max_speed,
        mean_acceleration,
        max_acceleration,
        mean_jerk,
        max_jerk,
        heading_change,
        path_irregularity,
        time_not_moving,
        failure_to_progress,
        person_detour,
        person_delay,
        q1_mean,
        q1_minimum,
        q1_share_below_acceptable,
        q2_mean,
        q2_minimum,
        q2_share_below_acceptable,
    )
}


def episode_metrics(trajectory: Trajectory, without_robot: Trajectory | None = None) -> dict[str, float]:
    """All measures of an episode, by name.

    Args:
        without_robot: the same episode without the robot; `person_detour` and `person_delay` are NaN if it is missing
    """
    values = {name: metric(trajectory) for name, metric in METRICS.items()}
    if without_robot is not None:
        for compare in (person_detour, person_delay):
            values[compare.__name__] = compare(trajectory, without_robot)
    return values
