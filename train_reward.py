"""Train the default reward network: see --help."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from reward_model.base.commands import check_least, run_command
from reward_model.base.progress import progress_bars

if TYPE_CHECKING:
    from rich.progress import Progress

    from reward_model.data.examples import Part
    from reward_model.data.labelled_windows import LabelledWindows
    from reward_model.data.taught import TaughtWindows


@dataclass(frozen=True)
class TrainReward:
    """Train the default reward network on the published one's answers to simulated scenes, and on people's scores.

    Scenes over the whole range of the simulator are scored by the published network (Bachiller et al. 2021; import it
    first with `python -m reward_model import-published socnavgym==0.1.1`), each in four images; an ensemble of star
    networks learns the means of the four. The result is a checkpoint folder with a model card that says how far the two
    are apart. Interrupted, it goes on from the shards and the epochs that are in its work folder.
    """

    work: Path = Path("runs/reward")
    """Folder of the simulated shards and the trainings, which an interrupted run goes on from."""
    num_shards: int = 300
    """Shards of about 2,600 simulated windows to train on."""
    num_held_out: int = 4
    """Shards for the choice of epochs, and as many for the test, from episodes of their own."""
    ratings: Path | None = None
    """SocNav1's folder, whose train.jsonl joins the training; errors on its dev.jsonl are reported."""
    agents: tuple[str, ...] = ()
    """Agents, by name, run folder or file, whose visited states join the training."""
    shards_per_agent: int = 20
    """Shards of about 1,800 windows of each agent's episodes."""
    people_share: float = 0.08
    """The share of people's ratings in what is trained on."""
    hidden_sizes: tuple[int, ...] = (32, 32)
    """Sizes of the rounds."""
    members: int = 4
    """Networks of the ensemble."""
    max_epochs: int = 24
    batch_size: int = 256
    learning_rate: float = 1e-2
    seed: int = 67
    """Of scenes and training."""
    jobs: int = 2
    """Processes that simulate and train."""
    teacher: str = "published"
    """Weights of the network that scores."""
    output: Path = Path(__file__).parent / "reward_model" / "weights" / "default"
    """The checkpoint folder, replaced when training has finished."""
    genuine: Path | None = None
    """A folder of SocNav2 recordings, to compare the two networks on as well."""

    def run(self) -> None:
        """Simulate, label, train, save, and print what the checkpoint says about itself, as JSON."""
        check_least(self, num_shards=1, num_held_out=1, shards_per_agent=1, members=1, seed=0, jobs=1)
        if not 0 <= self.people_share < 1:
            raise ValueError(f"people_share must lie in 0..1, 1 excluded, got {self.people_share}")
        from dataclasses import replace

        from reward_model.data.labelled_windows import joined
        from reward_model.data.people import read_people
        from reward_model.graph.features import NUM_NODE_FEATURES
        from reward_model.scorer import SocialScorer, load_scorer
        from reward_model.training.distillation import compared, differences, recordings_to_compare, save_with_card
        from reward_model.training.ensemble import train_members, united
        from reward_model.training.fit import TrainingConfig

        if self.agents:
            from agents.policy_files import load_agent

            for agent in self.agents:
                load_agent(agent)  # where there is none, say so before hours of simulation
        recordings = [] if self.genuine is None else recordings_to_compare(self.genuine)
        config = TrainingConfig(
            self.max_epochs,
            self.max_epochs,
            self.batch_size,
            self.learning_rate,
            weight_decay=1e-4,
            seed=self.seed,
            optimizer="muon",
        )
        with progress_bars(kept=True) as progress:
            people = None if self.ratings is None else read_people(self.ratings, progress)
            parts, test = self._simulated(progress)
            if self.agents:
                parts["train"] = joined([parts["train"], *self._visited(progress)])
            counts = {**{part: len(windows) for part, windows in parts.items()}, "test": len(test.stars)}
            if people is not None:
                parts["train"] = people.joined(parts["train"], self.people_share, self.seed)
            bar = progress.add_task("train members", total=self.members)
            members = []
            sizes = (NUM_NODE_FEATURES, *self.hidden_sizes, 2)
            for member in train_members(sizes, config, parts, self.members, self.work, self.jobs):
                members.append(member)
                progress.advance(bar)
        members.sort(key=lambda member: int(member.about["training"]["seed"]))
        trained = united(members)
        scorer = SocialScorer(trained, "trained")
        about: dict[str, Any] = {
            "teacher": self.teacher,
            "windows": counts,
            **trained.about,
            "test": differences(trained, test),
        }
        if people is not None:
            about["people"] = {"share": self.people_share, **people.report(scorer)}
        if recordings:
            about["genuine"] = compared(load_scorer(self.teacher), trained, recordings)
        save_with_card(self.output, replace(trained, about=about))
        print(json.dumps(about, indent=2))

    def _simulated(self, progress: Progress) -> tuple[dict[Part, LabelledWindows], TaughtWindows]:
        """What is to be learned of the training and the development windows, and the test windows."""
        from reward_model.data.examples import PARTS
        from socnav_env.simulated_data.labelled import load_shards, simulate_shards

        parts: dict[Part, LabelledWindows] = {}
        for number, (part, size) in enumerate(
            zip(PARTS, (self.num_shards, self.num_held_out, self.num_held_out), strict=True)
        ):
            folder, bar = self.work / part, progress.add_task(f"simulate {part}", total=size)
            for count in simulate_shards(folder, size, 3 * self.seed + number, self.teacher, self.jobs):
                progress.update(bar, completed=count)
            taught = load_shards(folder, size)
            if part != "test":
                parts[part] = taught.to_learn()
        return parts, taught

    def _visited(self, progress: Progress) -> list[LabelledWindows]:
        """What is to be learned of the states that the agents visit."""
        from agents.visited import AgentEpisode
        from socnav_env.simulated_data.labelled import load_shards, simulate_shards

        found = []
        for number, agent in enumerate(self.agents):
            episode, folder = AgentEpisode(agent), self.work / f"agent{number}"
            bar = progress.add_task(f"visit {agent}", total=self.shards_per_agent)
            for count in simulate_shards(
                folder, self.shards_per_agent, self.seed, self.teacher, self.jobs, episode, episode.name
            ):
                progress.update(bar, completed=count)
            found.append(load_shards(folder, self.shards_per_agent).to_learn())
        return found


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status: 0, 2 for bad input, 130 when interrupted."""
    return run_command("python train_reward.py", TrainReward, arguments)


if __name__ == "__main__":
    sys.exit(main())
