import hashlib
import math
import subprocess
import sys

import numpy as np
import pytest

from socnav_env.config import EnvConfig
from socnav_env.geometry.distances import box_distances, boxes_of, wall_distances
from socnav_env.layout import Layout, ObjectKind
from socnav_env.scenes.population import sample_layout
from socnav_env.scenes.rooms import l_room, rectangular_room
from socnav_env.simulation.world import Contacts, World

STAND = np.zeros(3)
FORWARD = np.array([0.3, 0.0, 0.0])  # m/s, m/s, rad/s


def layout_with(robot=(0.0, 0.0, 0.0), people=(), walk=(), groups=None, tables=(), goal=(0.0, 4.0), room=None):
    return Layout(
        room=room or rectangular_room(10, 10),
        robot_pose=np.array(robot, dtype=np.float64),
        goal=np.array(goal, dtype=np.float64),
        people_poses=np.array(people, dtype=np.float64).reshape(-1, 3),
        people_walk=np.array(walk, dtype=np.bool_),
        people_group=np.array(groups or [-1] * len(people), dtype=np.int64),
        object_poses=np.array(tables, dtype=np.float64).reshape(-1, 3),
        object_sizes=np.full((len(tables), 2), 0.8),
        object_kinds=np.full(len(tables), ObjectKind.TABLE),
        interaction_pairs=np.empty((0, 2), dtype=np.int64),
        interaction_relations=(),
    )


def world_of(layout, seed=0, **values):
    return World(layout, EnvConfig.from_dict(values), np.random.default_rng(seed))


def run(world, command, periods):
    for _ in range(periods):
        world.advance(command)
    return world


def test_time_begins_before_the_episode():
    world = world_of(layout_with())
    assert world.time == -2.0
    run(world, STAND, 10)
    assert world.time == 0.0
    run(world, STAND, 3)
    assert world.time == pytest.approx(0.6)


def test_the_robot_does_what_it_is_told():
    world = run(world_of(layout_with(robot=(0.0, 0.0, math.pi / 2))), FORWARD, 10)
    assert world.robot_pose == pytest.approx([0.0, 0.6, math.pi / 2])
    assert world.robot_velocity == pytest.approx([0.0, 0.3, 0.0])
    assert world.command.tolist() == [0.3, 0.0, 0.0]
    run(world, np.array([-0.2, 0.0, 0.0]), 5)
    assert world.robot_pose == pytest.approx([0.0, 0.4, math.pi / 2])


def test_driving_and_turning_follow_a_circle():
    world = run(world_of(layout_with()), np.array([0.3, 0.0, 0.3]), 25)
    assert world.robot_pose == pytest.approx([math.sin(1.5), 1 - math.cos(1.5), 1.5], abs=1e-4)
    run(world, np.array([0.0, 0.0, 0.3]), 35)
    assert world.robot_pose[2] == pytest.approx(3.6 - 2 * math.pi)
    assert world.robot_velocity == pytest.approx([0.0, 0.0, 0.3])


def test_a_holonomic_robot_drives_to_its_left():
    world = world_of(layout_with(robot=(0.0, 0.0, math.pi / 2)), robot={"drive": "holonomic"})
    run(world, np.array([0.1, 0.3, 0.0]), 10)
    assert world.robot_pose == pytest.approx([-0.6, 0.2, math.pi / 2])
    assert world.command.tolist() == [0.1, 0.3, 0.0]


def test_a_robot_of_limited_acceleration_takes_its_time():
    world = world_of(layout_with(), robot={"max_acceleration": 0.5})
    world.advance(FORWARD)
    assert world.robot_pose[0] == pytest.approx(0.05 * (0.025 + 0.05 + 0.075 + 0.1))
    run(world, FORWARD, 4)
    assert world.robot_velocity == pytest.approx([0.3, 0.0, 0.0])


def test_noise_in_the_motors_is_the_episodes_own():
    def end(seed, **robot):
        return run(world_of(layout_with(), seed, robot=robot), FORWARD, 20).robot_pose.tolist()

    noise = {"speed_noise": 0.05, "turn_noise": 0.05}
    assert end(1, **noise) == end(1, **noise) != end(2, **noise)
    assert end(1) == end(2) == pytest.approx([1.2, 0.0, 0.0])


@pytest.mark.parametrize(
    ("layout", "expected"),
    [
        (layout_with(robot=(4.5, 0.0, 0.0)), Contacts(wall=True)),
        (layout_with(tables=[(1.0, 0.0, 0.0)]), Contacts(object=True)),
        (layout_with(people=[(0.9, 0.0, 0.0)], walk=[False]), Contacts(person=True)),
    ],
)
def test_the_robot_stops_at_what_it_touches(layout, expected):
    world = world_of(layout)
    start = world.robot_pose
    before = [*world.clearance_to_walls(), *world.clearance_to_objects(), *world.clearance_to_people()]
    while not world.contacts and world.time < 3:
        world.advance(FORWARD)
    assert world.contacts == expected
    run(world, FORWARD, 100)
    clearances = np.concatenate([world.clearance_to_walls(), world.clearance_to_objects(), world.clearance_to_people()])
    assert -0.03 < clearances.min() <= 0.0
    assert math.dist(world.robot_pose[:2], start[:2]) == pytest.approx(min(before), abs=0.03)
    assert world.people_poses.tolist() == layout.people_poses.tolist()
    run(world, -FORWARD, 10)
    assert not world.contacts


def test_questions_have_the_answers_one_measures_by_hand():
    layout = layout_with(
        people=[(2.0, 0.0, 0.0), (0.0, -3.0, 0.0)],
        walk=[False, False],
        tables=[(0.0, 2.0, math.pi / 4)],
        goal=(0.3, 0.4),
    )
    world = world_of(layout)
    assert world.clearance_to_people() == pytest.approx([1.5, 2.5])
    assert world.clearance_to_objects() == pytest.approx([2.0 - 0.4 * math.sqrt(2) - 0.25])
    assert world.clearance_to_walls() == pytest.approx([4.75] * 4)
    assert world.distance_to_goal() == pytest.approx(0.5)
    assert world_of(layout_with(goal=(0.3, 0.39))).arrived()
    assert not world_of(layout_with(goal=(0.3, 0.41))).arrived()


def test_people_who_stand_stay_and_people_who_walk_do_not():
    layout = layout_with(robot=(-4.0, -4.0, 0.0), people=[(0.0, 0.0, 1.0), (2.0, 2.0, 1.0)], walk=[False, True])
    world = run(world_of(layout), STAND, 20)
    assert world.people_poses[0].tolist() == [0.0, 0.0, 1.0]
    assert world.people_velocities[0].tolist() == [0.0, 0.0, 0.0]
    assert math.dist(world.people_poses[1, :2], (2.0, 2.0)) > 0.5
    assert np.hypot(*world.people_velocities[1, :2]) > 0.3
    assert world.people_targets[0].tolist() == [0.0, 0.0]


def test_velocities_are_displacements_over_the_control_period():
    world = run(world_of(layout_with(people=[(2.0, 2.0, 3.0)], walk=[True])), STAND, 10)
    before = world.people_poses
    world.advance(STAND)
    change = world.people_poses - before
    change[:, 2] = np.remainder(change[:, 2] + math.pi, 2 * math.pi) - math.pi
    assert world.people_velocities == pytest.approx(change / 0.2, abs=1e-12)


def test_what_a_world_returns_can_be_written_to():
    world = run(world_of(layout_with(people=[(2.0, 2.0, 0.0)], walk=[True])), STAND, 5)
    poses, robot = world.people_poses.copy(), world.robot_pose.copy()
    world.people_poses[:] = 9.0
    world.robot_pose[:] = 9.0
    world.people_targets[:] = 9.0
    world.command[:] = 9.0
    assert world.people_poses.tolist() == poses.tolist()
    assert world.robot_pose.tolist() == robot.tolist()


@pytest.mark.parametrize("visibility", [0.0, 1.0])
def test_nobody_touches_the_standing_robot_before_the_episode_begins(visibility):
    config = EnvConfig.from_dict({"people": {"robot_visibility": visibility}})
    rng = np.random.default_rng(3)
    for _ in range(300):
        world = World(sample_layout(config, rng), config, rng)
        while world.time < 0:
            world.advance(STAND)
            assert not world.contacts
        assert world.clearance_to_people().min(initial=9.0) > 0.1


def test_people_notice_a_visible_robot_and_walk_into_an_invisible_one():
    """A walker shut into a corridor with the robot in its middle."""
    layout = layout_with(people=[(-4.0, 0.0, 0.0)], walk=[True], room=rectangular_room(10, 1), goal=(4.5, 0.0))
    touched = {}
    for visibility in (0.0, 1.0):
        worlds = [world_of(layout, seed, people={"robot_visibility": visibility}) for seed in range(10)]
        touched[visibility] = 0
        for world in worlds:
            touched[visibility] += any(run(world, STAND, 1).contacts.person for _ in range(150))
    assert touched[1.0] == 0
    assert touched[0.0] > 0


def test_people_pass_neither_walls_nor_objects_nor_each_other():
    config = EnvConfig.from_dict(
        {"people": {"robot_visibility": 0.0}, "population": {"wandering": [4, 4], "tables": [1, 3]}}
    )
    for seed in range(20):
        rng = np.random.default_rng(seed)
        layout = sample_layout(config, rng)
        world = World(layout, config, rng)
        group = layout.people_group
        together = (group[:, None] == group) & (group >= 0) | np.eye(layout.num_people, dtype=bool)
        for _ in range(150):
            world.advance(STAND)
            places = world.people_poses[:, :2]
            apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
            assert apart[~together].min() > 0.45
            for x, y in places[layout.people_walk]:
                assert wall_distances(x, y, layout.room.walls).min() > 0.2
                assert box_distances(x, y, boxes_of(layout.object_poses, layout.object_sizes)).min(initial=9.0) > 0.2


def test_physics_keeps_people_apart_where_no_force_does():
    values = {"avoidance": 0.0, "wall_repulsion": 0.0, "patience": 9.0, "robot_visibility": 0.0}
    people = [(-1.0, 0.0, 0.0), (1.0, 0.0, math.pi), (0.0, 1.0, 0.0)]
    layout = layout_with(robot=(-4.0, 0.0, 0.0), people=people, walk=[True, True, False], room=rectangular_room(9, 2.6))
    for seed in range(5):
        world = world_of(layout, seed, people=values)
        for _ in range(150):
            world.advance(STAND)
            places = world.people_poses[:, :2]
            assert math.dist(places[0], places[1]) > 0.45
            assert math.dist(places[0], places[2]) > 0.45
            assert np.abs(places[:, 1]).max() < 1.3 - 0.2
        assert world.people_poses[2].tolist() == [0.0, 1.0, 0.0]


def test_walkers_get_new_targets_in_sight_and_off_the_goal():
    layout = layout_with(people=[(3.0, -3.0, 0.0)], walk=[True], room=l_room(3), robot=(-4, 4, 0), goal=(3.0, 3.0))
    world = world_of(layout)
    targets = {tuple(run(world, STAND, 1).people_targets[0]) for _ in range(300)}
    assert 3 <= len(targets) <= 10
    assert min(math.dist(target, (3.0, 3.0)) for target in targets) >= 0.65
    assert max(wall_distances(*target, layout.room.walls).min() for target in targets) >= 0.4


DIGEST = """
import hashlib, numpy as np
from socnav_env.config import EnvConfig
from socnav_env.scenes.population import sample_layout
from socnav_env.simulation.world import World
config, digest = EnvConfig(), hashlib.sha256()
for seed in range(5):
    rng = np.random.default_rng(seed)
    world = World(sample_layout(config, rng), config, rng)
    for step in range(100):
        world.advance(np.array([0.3, 0.0, 0.3 * np.sin(step / 10)]))
        digest.update(world.people_poses.tobytes() + world.robot_pose.tobytes())
print(digest.hexdigest())
"""


def test_a_seed_gives_the_same_bits_in_another_process():
    command = [sys.executable, "-c", DIGEST]
    first, second = (subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2))
    assert first == second
    assert len(bytes.fromhex(first.strip())) == hashlib.sha256().digest_size


def test_people_who_stand_by_config_never_move():
    people, walk = [(2.0, 2.0, 0.0), (-2.0, 2.0, 1.0)], [True, False]
    world = run(world_of(layout_with(people=people, walk=walk), people={"model": "standing"}), STAND, 30)
    assert world.people_poses.tolist() == [[2.0, 2.0, 0.0], [-2.0, 2.0, 1.0]]
    assert world.people_targets.tolist() == [[2.0, 2.0], [-2.0, 2.0]]
