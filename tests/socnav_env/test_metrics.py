import numpy as np
import pytest

from socnav_env.metrics import METRICS, episode_metrics
from socnav_env.outcomes import Outcome
from socnav_env.trajectory import Trajectory
from tests.socnav_env.puppets import make_layout

# A robot drives 0.3, 0.4 and 0.0 m and one step back along the x axis, towards a goal at x = 2. One person waits at
# x = 1.5, another one far away. Radii 0.25 each, so surfaces are 0.5 m closer than centres.
ROBOT_X = [0.0, 0.3, 0.7, 0.7, 0.6]
SPEEDS = [0.0, 1.5, -2.0, 0.005, 0.5]
TURN_RATES = [0.0, 0.0, 0.1, -0.01, 0.0]
SCORES = [[1.0, 0.9], [0.8, 0.5], [0.39, 0.4], [0.2, 0.1]]


def make_trajectory(outcome: Outcome | None = Outcome.ARRIVED, **changes) -> Trajectory:
    rows = len(ROBOT_X)
    values = {
        "layout": make_layout(),
        "control_period": 0.2,
        "robot_radius": 0.25,
        "people_radius": 0.25,
        "robot_poses": np.column_stack([ROBOT_X, np.zeros((rows, 2))]),
        "robot_velocities": np.column_stack([SPEEDS, np.zeros(rows), TURN_RATES]),
        "people_poses": np.tile([[1.5, 0.0, 0.0], [9.0, 0.0, 0.0]], (rows, 1, 1)),
        "people_velocities": np.zeros((rows, 2, 3)),
        "scores": np.array(SCORES),
        "outcome": outcome,
    }
    return Trajectory(**{**values, **changes})


# Centre distances to the closest person after each step: 1.2, 0.8, 0.8, 0.9; surfaces: 0.7, 0.3, 0.3, 0.4.
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("success", 1.0),
        ("timeout", 0.0),
        ("collision_person", 0.0),
        ("collision_object", 0.0),
        ("collision_wall", 0.0),
        ("time_to_goal", 0.8),
        ("path_length", 0.3 + 0.4 + 0.0 + 0.1),
        ("min_person_distance", 0.3),
        ("mean_min_person_distance", (0.7 + 0.3 + 0.3 + 0.4) / 4),
        ("intimate_zone", 0.0),
        ("personal_zone", 100.0),
        ("social_zone", 100.0),
        ("discomfort_rate", 0.0),
        ("discomfort_distance", np.nan),
        ("mean_speed", (1.5 + 2.0 + 0.005 + 0.5) / 4),
        ("max_speed", 2.0),
        ("time_not_moving", 0.2),
        ("failure_to_progress", 2.0),
        ("q1_mean", (1.0 + 0.8 + 0.39 + 0.2) / 4),
        ("q1_minimum", 0.2),
        ("q1_share_below_acceptable", 0.5),
        ("q2_mean", (0.9 + 0.5 + 0.4 + 0.1) / 4),
        ("q2_minimum", 0.1),
        ("q2_share_below_acceptable", 0.25),
    ],
)
def test_measures_of_a_drive_towards_somebody(name: str, value: float) -> None:
    assert METRICS[name](make_trajectory()) == pytest.approx(value, nan_ok=True)


# Centre distances per row: 0.8, 0.4, 0.4, 0.5; 1.4, 1.0, 1.0, 1.1; 3.8, 3.4, 3.4, 3.5.
@pytest.mark.parametrize(
    ("person_x", "zones", "discomfort_rate", "discomfort_distance"),
    [
        (1.1, (50.0, 100.0, 100.0), 0.75, (-0.1 - 0.1 + 0.0) / 3),
        (1.7, (0.0, 75.0, 100.0), 0.0, np.nan),
        (4.1, (0.0, 0.0, 75.0), 0.0, np.nan),
    ],
)
def test_zones_are_centre_distances_and_discomfort_is_between_surfaces(
    person_x: float, zones: tuple[float, ...], discomfort_rate: float, discomfort_distance: float
) -> None:
    metrics = episode_metrics(make_trajectory(people_poses=np.tile([person_x, 0.0, 0.0], (5, 1, 1))))
    assert (metrics["intimate_zone"], metrics["personal_zone"], metrics["social_zone"]) == zones
    assert metrics["discomfort_rate"] == discomfort_rate
    assert metrics["discomfort_distance"] == pytest.approx(discomfort_distance, nan_ok=True)


@pytest.mark.parametrize("outcome", [None, *Outcome])
def test_an_episode_has_one_outcome_and_only_success_has_a_time_to_the_goal(outcome: Outcome | None) -> None:
    metrics = episode_metrics(make_trajectory(outcome))
    ends = {
        "success": metrics["success"],
        "timeout": metrics["timeout"],
        "collision_person": metrics["collision_person"],
        "collision_object": metrics["collision_object"],
        "collision_wall": metrics["collision_wall"],
    }
    expected = {None: None, Outcome.ARRIVED: "success"}.get(outcome, outcome)
    assert ends == {name: float(name == expected) for name in ends}
    assert np.isnan(metrics["time_to_goal"]) == np.isnan(metrics["path_length"]) == (outcome is not Outcome.ARRIVED)


def test_nobody_is_at_no_distance_and_in_no_zone() -> None:
    metrics = episode_metrics(make_trajectory(people_poses=np.zeros((5, 0, 3)), people_velocities=np.zeros((5, 0, 3))))
    assert np.isnan(metrics["min_person_distance"])
    assert np.isnan(metrics["mean_min_person_distance"])
    assert metrics["intimate_zone"] == metrics["personal_zone"] == metrics["social_zone"] == 0.0
    assert metrics["discomfort_rate"] == 0.0


def test_scores_that_nobody_gave_are_not_a_number() -> None:
    metrics = episode_metrics(make_trajectory(scores=np.full((4, 2), np.nan)))
    scored = [name for name in METRICS if name.startswith(("q1", "q2"))]
    assert len(scored) == 6
    assert all(np.isnan(metrics[name]) for name in scored)


def test_an_episode_without_steps_is_measured_without_complaint() -> None:
    start = make_trajectory(None)
    trajectory = make_trajectory(
        None,
        robot_poses=start.robot_poses[:1],
        robot_velocities=start.robot_velocities[:1],
        people_poses=start.people_poses[:1],
        people_velocities=start.people_velocities[:1],
        scores=np.zeros((0, 2)),
    )
    metrics = episode_metrics(trajectory)
    assert metrics["success"] == metrics["failure_to_progress"] == metrics["time_not_moving"] == 0.0
    assert np.isnan(metrics["mean_speed"])


def test_measuring_leaves_the_recording_as_it_is() -> None:
    trajectory, untouched = make_trajectory(), make_trajectory()
    episode_metrics(trajectory)
    for name in ("robot_poses", "robot_velocities", "people_poses", "people_velocities", "scores"):
        np.testing.assert_array_equal(getattr(trajectory, name), getattr(untouched, name))
