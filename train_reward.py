"""Train the default reward network: see --help."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from reward_model.base.commands import check_least, run_command
from reward_model.base.progress import progress_bars


@dataclass(frozen=True)
class TrainReward:
    """Train the default reward network on the published one's answers to simulated scenes.

    Scenes under good and bad drivers are scored by the published network (Bachiller et al. 2021; import it first with
    `python -m reward_model import-published socnavgym==0.1.1`), and a small MPNN learns those scores. The result is a
    checkpoint folder with a model card that says how far the two are apart.
    """

    num_windows: int = 260_000
    """Simulated windows to train on; as many again, mirrored, are labelled and trained on too."""
    num_held_out: int = 3_000
    """Windows for stopping early, and as many for the test, from episodes of their own."""
    hidden_sizes: tuple[int, ...] = (40, 28, 20)
    """Features of the hidden layers."""
    max_epochs: int = 6
    patience: int = 3
    """Epochs without a better development error before training stops."""
    batch_size: int = 64
    learning_rate: float = 1e-2
    seed: int = 67
    """Of scenes and training."""
    jobs: int = 2
    """Processes that simulate."""
    output: Path = Path(__file__).parent / "reward_model" / "weights" / "default"
    """The checkpoint folder, replaced when training has finished."""
    genuine: Path | None = None
    """A folder of SocNav2 recordings, to compare the two networks on as well."""

    def run(self) -> None:
        """Simulate, label, train, save, and print what the checkpoint says about itself, as JSON."""
        check_least(self, num_windows=1, num_held_out=1, seed=0, jobs=1)
        from reward_model.data.examples import PARTS
        from reward_model.graph.features import NUM_NODE_FEATURES
        from reward_model.networks.registry import MPNNConfig
        from reward_model.scorer import load_scorer
        from reward_model.training.distillation import compared, distil, recordings_to_compare, save_with_card
        from reward_model.training.fit import TrainingConfig
        from socnav_env.simulated_data.windows import generate_windows

        network = MPNNConfig((NUM_NODE_FEATURES, *self.hidden_sizes, 2), "tabulated")
        config = TrainingConfig(self.max_epochs, self.patience, self.batch_size, self.learning_rate, seed=self.seed)
        recordings = [] if self.genuine is None else recordings_to_compare(self.genuine)
        teacher = load_scorer("published")
        sizes = (self.num_windows, self.num_held_out, self.num_held_out)
        with progress_bars(kept=True) as progress:
            bar, windows = progress.add_task("simulate", total=len(PARTS)), {}
            for number, (part, size) in enumerate(zip(PARTS, sizes, strict=True)):
                windows[part] = generate_windows(size, 3 * self.seed + number, self.jobs)
                progress.advance(bar)
            checkpoint = distil(teacher, windows, network, config, progress)
        if recordings:
            checkpoint = compared(teacher, checkpoint, recordings)
        save_with_card(self.output, checkpoint)
        print(json.dumps(checkpoint.about, indent=2))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status: 0, 2 for bad input, 130 when interrupted."""
    return run_command("python train_reward.py", TrainReward, arguments)


if __name__ == "__main__":
    sys.exit(main())
