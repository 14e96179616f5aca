"""Every command line answers what is missing, unknown or broken with one line on stderr and exit status 2."""

import json
import re
from importlib import import_module
from pathlib import Path

import pytest

from reward_model.analysis.synthetic_scenes import Person, SyntheticScene
from reward_model.scenes.scene import LabelledSequence
from reward_model.scenes.socnav2_json import encode_socnav2
from tests.reward_model.example_scenes import hand_made_document
from tests.reward_model.scenes.test_socnav1 import RATING

PROJECT = Path(__file__).parents[1]
REWARD_MODEL = "reward_model.commands.main"
SOCNAV_ENV = "socnav_env.commands.main"
AGENTS = "agents.__main__"
PROGRAMS = {
    REWARD_MODEL: "reward_model",
    SOCNAV_ENV: "socnav_env",
    AGENTS: "agents",
    "agents.training_command": "train_agent.py",
    "train_reward": "train_reward.py",
    "benchmarks.__main__": "benchmarks",
    "benchmarks.realism.__main__": "benchmarks.realism",
    "benchmarks.robustness.__main__": "benchmarks.robustness",
}
WITHOUT_INPUT = {"config", "scenarios"}

CASES = [
    (REWARD_MODEL, "score missing.json", "missing.json: cannot read it"),
    (REWARD_MODEL, "score scene.json --weights nobody", "weights must be 'default', 'published' or a checkpoint"),
    (REWARD_MODEL, "score scene.json --weights published", "import-published socnavgym==0.1.1"),
    (REWARD_MODEL, "score scene.json --weights broken", "config.json: not readable as JSON"),
    (REWARD_MODEL, "score scene.json --time-scale 0", "time_scale must be a positive number, got 0.0"),
    (REWARD_MODEL, "score scene.json broken.json", "broken.json: line 1, column 2: must be JSON"),
    (REWARD_MODEL, "heatmap scene.json -o map.png --time-scale nan", "time_scale must be a positive number, got nan"),
    (REWARD_MODEL, "heatmap missing.json -o map.png", "missing.json: cannot read it"),
    (REWARD_MODEL, "heatmap scene.json -o map.png --weights nobody", "got 'nobody'"),
    (REWARD_MODEL, "heatmap broken.json -o map.png", "broken.json: line 1, column 2: must be JSON"),
    (REWARD_MODEL, "behaviours --weights nobody", "got 'nobody'"),
    (REWARD_MODEL, "behaviours --weights broken", "config.json: not readable as JSON"),
    (REWARD_MODEL, "import-published missing.whl", "source must be an existing wheel or folder"),
    (REWARD_MODEL, "import-published broken.whl", "broken.whl"),
    (REWARD_MODEL, "train --data missing --output made", "missing: data must be an existing file or folder"),
    (REWARD_MODEL, "train --data scenes --output made --device nobody", "device must be one that PyTorch can use"),
    (REWARD_MODEL, "train --data scenes --output made --teacher nobody", "got 'nobody'"),
    (REWARD_MODEL, "train --data recordings --output made", "broken.json: line 1, column 2: must be JSON"),
    (REWARD_MODEL, "search --data missing --output made", "missing: data must be an existing file or folder"),
    (
        REWARD_MODEL,
        "search --data scenes --output made --device nobody",
        "device must be one that PyTorch can use",
    ),
    (REWARD_MODEL, "search --data scenes --output made --teacher nobody", "got 'nobody'"),
    (REWARD_MODEL, "search --data recordings --output made", "broken.json: line 1, column 2: must be JSON"),
    (REWARD_MODEL, "label --data missing --output made", "missing: data must be an existing file or folder"),
    (REWARD_MODEL, "label --data scenes --output made --weights nobody", "got 'nobody'"),
    (REWARD_MODEL, "label --data recordings --output made --weights default", "broken.json: line 1, column 2"),
    (REWARD_MODEL, "experiments --data missing --output made --kind static", "missing: data must be an existing"),
    (REWARD_MODEL, "experiments --data scenes --output made --kind simulated --teacher nobody", "got 'nobody'"),
    (REWARD_MODEL, "experiments --data recordings --output made --kind static", "broken.json: line 1, column 2"),
    (REWARD_MODEL, "evaluate --data missing", "missing: data must be an existing file or folder"),
    (REWARD_MODEL, "evaluate --data scenes --weights nobody", "got 'nobody'"),
    (REWARD_MODEL, "evaluate --data recordings", "broken.json: line 1, column 2: must be JSON"),
    (REWARD_MODEL, "agreement missing.csv", "missing.csv"),
    (REWARD_MODEL, "agreement ratings.jsonl scene.json", "scene.json"),
    (REWARD_MODEL, "agreement broken.jsonl", "broken.jsonl"),
    (SOCNAV_ENV, "render missing.npz -o picture.png", "missing.npz: cannot read it"),
    (SOCNAV_ENV, "render picture.png --driver nobody --reward sparse", "driver must be one of goal"),
    (SOCNAV_ENV, "render picture.png --env-config missing.json", "missing.json: No such file or directory"),
    (SOCNAV_ENV, "render picture.png --env-config broken.json", "broken.json: "),
    (SOCNAV_ENV, "play --env-config missing.json", "missing.json: No such file or directory"),
    (SOCNAV_ENV, "play --reward nobody", "reward must be one of learned"),
    (SOCNAV_ENV, "play --env-config broken.json", "broken.json: "),
    (SOCNAV_ENV, "replay missing.npz", "missing.npz: cannot read it"),
    (SOCNAV_ENV, "replay broken.json", "broken.json: must be a whole .npz file"),
    (SOCNAV_ENV, "metrics missing.json", "missing.json: No such file or directory"),
    (SOCNAV_ENV, "metrics scene.json --weights nobody", "got 'nobody'"),
    (SOCNAV_ENV, "metrics broken.json", "broken.json: line 1, column 2: must be JSON"),
    (SOCNAV_ENV, "export missing.npz -o scene.json", "missing.npz: cannot read it"),
    (SOCNAV_ENV, "export broken.json -o scene.json", "broken.json: must be a whole .npz file"),
    (
        SOCNAV_ENV,
        "generate --num-sequences 1 -o made --backend nobody",
        "backend must be one of loky, ray, got 'nobody'",
    ),
    (SOCNAV_ENV, "generate --num-sequences 1 -o broken", "manifest.json: must be a manifest of simulated sequences"),
    (AGENTS, "evaluate random --env-config missing.json", "missing.json: cannot be read: No such file or directory"),
    (AGENTS, "evaluate nobody", "no agent 'nobody'; valid are random"),
    (AGENTS, "evaluate random --scenario nobody", "scenario must be one of blind_corner"),
    (AGENTS, "evaluate random --env-config broken.json", "broken.json: is not valid JSON"),
    ("agents.training_command", "--resume missing", "missing: is no training run"),
    ("agents.training_command", "--output-dir made --reward nobody", "reward must be one of learned"),
    ("agents.training_command", "--output-dir made --env-config missing.json", "missing.json: cannot be read"),
    ("agents.training_command", "--output-dir made --env-config broken.json", "broken.json: is not valid JSON"),
    ("agents.training_command", "--resume broken", "config.json: is not valid JSON"),
    ("train_reward", "--output made --genuine missing", "missing: must hold SocNav2 recordings (*.json), found none"),
    ("train_reward", "--output made", "import-published socnavgym==0.1.1"),
    ("train_reward", "--output made --jobs 0", "jobs must be at least 1, got 0"),
    ("train_reward", "--output made --batch-size 0", "batch_size must be positive, got 0"),
    ("train_reward", "--output made --genuine recordings", "broken.json: line 1, column 2: must be JSON"),
    ("benchmarks.__main__", "--only rates nobody", "only must name sections of rates"),
    ("benchmarks.lidar", "--scans 0", "scans must be at least 1, got 0"),
    ("benchmarks.processes", "0 64", "num_envs must be at least 1, got 0"),
    ("benchmarks.reward_errors", "--weights nobody", "got 'nobody'"),
    ("benchmarks.reward_errors", "--episodes 0", "episodes must be at least 1, got 0"),
    ("benchmarks.reward_hacking", "--only nobody", "only must name policies of stand, spin"),
    ("benchmarks.reward_hacking", "--episodes 0", "episodes must be at least 1, got 0"),
    ("benchmarks.reward_hacking", "--reward nobody", "reward must be one of learned"),
    ("benchmarks.reward_hacking", "--weights nobody", "got 'nobody'"),
    ("benchmarks.reward_hacking", "--env-config missing.json", "missing.json: No such file or directory"),
    ("benchmarks.reward_hacking", "--env-config broken.json", "broken.json: "),
    ("benchmarks.scoring", "--data missing", "missing: must hold recordings in socnav2_samples"),
    ("benchmarks.scoring", "--data broken", "S1.json: line 1, column 2: must be JSON"),
    ("benchmarks.time_scale", "--episodes 0", "episodes must be at least 1, got 0"),
    ("benchmarks.time_scale", "--speed 9", "at top speed a body must move less than its radius in a physics step"),
    ("benchmarks.time_scale", "--weights nobody", "weights must be 'default', 'published' or a checkpoint folder"),
    ("benchmarks.training", "--batch-size 0", "batch_size must be at least 1, got 0"),
    ("benchmarks.realism.__main__", "--data missing", "hotel.txt: must be a file of tracks"),
    ("benchmarks.realism.__main__", "--data broken", "hotel.txt: must be a file of tracks"),
    ("benchmarks.robustness.__main__", "--weights nobody", "weights must be 'default', 'published' or a checkpoint"),
    ("benchmarks.robustness.__main__", "--scenes 0", "scenes must be at least 1, got 0"),
    ("benchmarks.realism.walking", "--data missing", "missing: must hold SocNav2 sequences, S*.json, found none"),
    ("benchmarks.realism.walking", "--data broken", "S1.json: line 1, column 2: must be JSON"),
]


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """A folder to run in, with a scene, ratings, and what is broken in every way that a command looks at."""
    monkeypatch.setenv("SOCNAV_CACHE", str(tmp_path / "cache"))
    contents = {}
    for step, name in enumerate("ab"):
        scene = SyntheticScene((2.0, 1.0), people=[Person(1.0 + step, -1.0)]).sequence(name)
        contents[f"scenes/{name}.json"] = encode_socnav2(LabelledSequence(scene, 0.5, 0.5))
    contents |= {"scenes/train_set.txt": b"a.json", "scenes/dev_set.txt": b"b.json"}
    contents["recordings/a.json"] = contents["scenes/a.json"]
    contents["scene.json"] = json.dumps(hand_made_document()).encode()
    contents["ratings.jsonl"] = json.dumps(RATING).encode()
    broken = ["broken.json", "broken.jsonl", "broken.whl", "recordings/broken.json"]
    names = ["config.json", "model.safetensors", "manifest.json", "hotel.txt", "S1.json", "socnav2_samples/S1.json"]
    contents |= dict.fromkeys([*broken, *(f"broken/{name}" for name in names)], b"{")
    for name, content in contents.items():
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_bytes(content)
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("in_folder")
@pytest.mark.parametrize(("module", "arguments", "complaint"), CASES, ids=[" ".join(case[:2]) for case in CASES])
def test_bad_input_is_one_line(module, arguments, complaint, capfd):
    assert import_module(module).main(arguments.split()) == 2
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(f"{PROGRAMS.get(module, module)}: ")
    assert complaint in printed.err
    assert printed.err.endswith("\n") and printed.err.count("\n") == 1


def test_every_command_line_is_among_them():
    modules = {module for module, _, _ in CASES}
    called = {
        module
        for path in (*PROJECT.glob("*.py"), *(PROJECT / "benchmarks").rglob("*.py"))
        for module in [".".join(path.relative_to(PROJECT).with_suffix("").parts)]
        if re.search(r'^if __name__ == "__main__"', path.read_text(), re.MULTILINE)
    }
    assert called - {"train_agent"} <= modules
    for package in (REWARD_MODEL, SOCNAV_ENV, AGENTS):
        named = {arguments.split()[0] for module, arguments, _ in CASES if module == package}
        assert named == set(import_module(package).COMMANDS) - WITHOUT_INPUT
