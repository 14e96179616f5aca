"""The star network: rows of entities encoded by kind, aggregated, and again with what the room has aggregated.

With e and o the even and odd columns of an entity's row, standardised, and g, h those of its room (`Stars`), each
image of the scene, the scene itself (+) and its mirror image (-), has

    x1 = relu(B relu(B (E e + G g +- (O o + H h))))      of every person, object, wall segment and pair
    r1 = relu(B (P pool(x1) + Q g +- S h))               of the room
    xk = relu(B (A x(k-1) + C r(k-1)))                   of every entity again, in rounds k = 2, 3, ...
    rk = relu(B (D [r(k-1), pool(xk)]))                  of the room again
    scores = mean over both images of sigmoid(W relu(B (F r)))

where B is an affine map with batch normalisation, and pool has two parts for each kind: the sum over its entities
times 10 / (number of nodes), and their mean weighted by attention, exp(a x). Swapping left and right swaps the two
images and nothing else, so the scores are the same. Several members are separate networks; the score is their mean.

Sources: aggregation by kind with a global node, Battaglia et al. 2018, "Relational inductive biases, deep learning,
and graph networks"; exact symmetry by even and odd parts, Cohen and Welling 2016, "Group equivariant convolutional
networks".
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from reward_model.base.arrays import Float32Array
from reward_model.graph.frame import FrameGraph
from reward_model.graph.star import KINDS, WIDTHS, Stars
from reward_model.networks.window_network import WindowNetwork

LIMIT: Final = 8.0  # standard deviations, beyond which inputs are clipped
SUM_SCALE: Final = 10.0  # over the number of nodes: the factor of sums
MOST_ATTENTION: Final = 10.0  # of the exponent, either way
LEAST_TOTAL: Final = 1e-3  # added to the sum of attention weights, for kinds without entities
_LEAST_DEVIATION: Final = 1e-3  # added to the deviation of inputs, for those that hardly vary

_ROWS_TOGETHER: Final = 100_000

CONTACT_SCORE: Final = float(np.nextafter(np.float32(0.05), np.float32(0.0)))
"""The highest score of a robot in contact with a person, an object or a wall: 0.05, and in single precision no more."""
CONTACT_DISTANCES: Final = (0.5001, 0.2501, 0.2501)
"""[m] from the robot's centre to a person's centre, an object's outline and a wall at which they touch, within 0.1 mm.

The robot's radius and a person's are those of the simulator, 0.25 m. The raters were told that a robot that hits
something scores 0 (Bachiller et al. 2021).
"""

_Batch = dict[str, tuple[Tensor, Tensor]]  # even and odd columns


def row_widths(size: int) -> dict[str, int]:
    """The features of each kind of rows in a round of a size."""
    return {"people": size, "objects": size // 2, "walls": size // 2, "pairs": size // 2}


class StarNetwork(WindowNetwork):
    """See the module.

    Args:
        sizes: 42, the size of each round (features of a person, twice those of other rows, half of the room's), 2
        members: separate networks whose mean is the score
    """

    windows_at_once = 1024

    def __init__(self, sizes: Sequence[int], members: int) -> None:
        super().__init__()
        rounds = sizes[1:-1]
        self.inputs = nn.ModuleDict({name: _Standardised(*widths) for name, widths in WIDTHS.items()})
        self.members = nn.ModuleList(_Member(rounds) for _ in range(members))

    def prepare(self, windows: Sequence[Sequence[FrameGraph]]) -> None:
        """Set the inputs' means and deviations to those of the training windows."""
        arrays = Stars.of_windows(windows).arrays()
        for name, standardised in self.inputs.items():
            standardised.measure(arrays[name])  # type: ignore[operator]

    def training_answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(members, num_windows, 2) each member's scores, contact or not."""
        stars = Stars.of_windows(windows)
        batch = {
            name: standardised(torch.from_numpy(getattr(stars, name)).to(device))
            for name, standardised in self.inputs.items()
        }
        counts = torch.from_numpy(stars.counts).to(device)
        return torch.stack([member(batch, counts) for member in self.members])

    def scores_and_deviations(
        self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu"
    ) -> Tensor:
        """(num_windows, 4) the members' mean for Q1 and Q2, at most 0.05 in contact; and their standard deviations."""
        stars = Stars.of_windows(windows)
        each = self.training_answers(stars, device)
        mean = each.mean(dim=0)
        touching = torch.from_numpy(in_contact(stars.surroundings)).to(device)
        capped = torch.where(touching.unsqueeze(1), mean.clamp(max=CONTACT_SCORE), mean)
        return torch.cat([capped, each.std(dim=0, correction=0)], dim=1)

    def answers(self, windows: Sequence[Sequence[FrameGraph]], device: torch.device | str = "cpu") -> Tensor:
        """(num_windows, 2) scores."""
        return self.scores_and_deviations(windows, device)[:, :2]


def in_contact(surroundings: Float32Array) -> NDArray[np.bool_]:
    """Whether the robot touches something, (num_windows,), by `surroundings` (num_windows, 4)."""
    touching: NDArray[np.bool_] = np.any(surroundings[:, :3] <= np.array(CONTACT_DISTANCES, dtype=np.float32), axis=1)
    return touching


class _Standardised(nn.Module):
    """Inputs less the mean of the even ones, over the deviation, within +-`LIMIT`; odd ones have the mean 0."""

    mean: Tensor
    deviation: Tensor

    def __init__(self, even: int, odd: int) -> None:
        super().__init__()
        self._even = even
        self.register_buffer("mean", torch.zeros(even + odd))
        self.register_buffer("deviation", torch.ones(even + odd))

    def measure(self, rows: Float32Array) -> None:
        if not len(rows):
            return
        total, squares = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
        for start in range(0, len(rows), _ROWS_TOGETHER):  # as doubles, all rows would fill the memory
            values = rows[start : start + _ROWS_TOGETHER].astype(np.float64)
            total += values.sum(axis=0)
            squares += (values**2).sum(axis=0)
        mean = total / len(rows)
        mean[self._even :] = 0.0
        deviation = np.sqrt(np.maximum(squares / len(rows) - mean**2, 0.0)) + _LEAST_DEVIATION
        self.mean.copy_(torch.from_numpy(mean))
        self.deviation.copy_(torch.from_numpy(deviation))

    def forward(self, rows: Tensor) -> tuple[Tensor, Tensor]:
        values = ((rows - self.mean) / self.deviation).clamp(-LIMIT, LIMIT)
        return values[:, : self._even], values[:, self._even :]


class _Member(nn.Module):
    def __init__(self, rounds: Sequence[int]) -> None:
        super().__init__()
        widths = [row_widths(size) for size in rounds]
        pooled = [2 * sum(each.values()) for each in widths]
        self.encoders = nn.ModuleDict({kind: _Encoder(*WIDTHS[kind], widths[0][kind]) for kind in KINDS})
        self.contexts = nn.ModuleList(
            nn.ModuleDict({kind: _Context(2 * size, before[kind], after[kind]) for kind in KINDS})
            for size, (before, after) in zip(rounds, pairwise(widths), strict=False)
        )
        self.attention = nn.ModuleList(
            nn.ModuleDict({kind: nn.Linear(each[kind], 1) for kind in KINDS}) for each in widths
        )
        self.own = _EvenOdd(*WIDTHS["rooms"], 2 * rounds[0])
        self.rooms = nn.ModuleList(
            _Layer(num_pooled + 2 * before, 2 * size)
            for num_pooled, before, size in zip(pooled, (0, *rounds), rounds, strict=False)
        )
        self.last = _Layer(2 * rounds[-1], rounds[-1])
        self.scores = nn.Linear(rounds[-1], 2)

    def forward(self, batch: _Batch, counts: Tensor) -> Tensor:
        """(num_windows, 2)."""
        num_windows, rooms = len(counts), batch["rooms"]
        inverse = (SUM_SCALE / (counts[:, :3].sum(dim=1) + 2)).to(rooms[0].dtype).repeat(2).unsqueeze(1)
        windows = torch.arange(num_windows, device=counts.device)
        owners = {
            kind: torch.repeat_interleave(windows, counts[:, column], output_size=len(batch[kind][0]))
            for column, kind in enumerate(KINDS)
        }
        of_images = {kind: torch.cat([owner, owner + num_windows]) for kind, owner in owners.items()}
        hidden = {kind: self.encoders[kind](batch[kind], rooms, owners[kind]) for kind in KINDS}
        room = self.rooms[0](self._pooled(0, hidden, of_images, inverse), self.own(rooms))
        for number, context in enumerate(self.contexts, 1):
            hidden = {kind: context[kind](hidden[kind], room, of_images[kind]) for kind in KINDS}  # type: ignore[index]
            pooled = self._pooled(number, hidden, of_images, inverse)
            room = self.rooms[number](torch.cat([room, pooled], dim=1))
        scores = torch.sigmoid(self.scores(self.last(room)))
        return (scores[:num_windows] + scores[num_windows:]) / 2

    def _pooled(self, number: int, hidden: dict[str, Tensor], owners: dict[str, Tensor], inverse: Tensor) -> Tensor:
        """(2 num_windows, pooled) sums and weighted means of every kind."""
        parts = []
        for kind, rows in hidden.items():
            attention = self.attention[number][kind](rows).clamp(-MOST_ATTENTION, MOST_ATTENTION).exp()  # type: ignore[index]
            columns = torch.cat([rows, attention * rows, attention], dim=1)
            sums = columns.new_zeros(len(inverse), columns.shape[1]).index_add(0, owners[kind], columns)
            plain, weighted, total = torch.split(sums, [rows.shape[1], rows.shape[1], 1], dim=1)
            parts += [plain * inverse, weighted / (total + LEAST_TOTAL)]
        return torch.cat(parts, dim=1)


class _EvenOdd(nn.Module):
    """A linear map of both images: (n, even) and (n, odd) -> (2 n, out), the scene's rows first."""

    def __init__(self, even: int, odd: int, out: int, bias: bool = False) -> None:
        super().__init__()
        self.even, self.odd = nn.Linear(even, out, bias=bias), nn.Linear(odd, out, bias=False)

    def forward(self, columns: tuple[Tensor, Tensor]) -> Tensor:
        even, odd = self.even(columns[0]), self.odd(columns[1])
        return torch.cat([even + odd, even - odd])


class _Layer(nn.Module):
    """A linear map, something to add, batch normalisation and ReLU."""

    def __init__(self, inputs: int, out: int) -> None:
        super().__init__()
        self.linear, self.norm = nn.Linear(inputs, out), nn.BatchNorm1d(out)

    def forward(self, rows: Tensor, added: Tensor | float = 0.0) -> Tensor:
        return torch.relu(_normalised(self.norm, self.linear(rows) + added))


class _Encoder(nn.Module):
    def __init__(self, even: int, odd: int, width: int) -> None:
        super().__init__()
        self.own, self.room = _EvenOdd(even, odd, width, bias=True), _EvenOdd(*WIDTHS["rooms"], width)
        self.norm, self.layer = nn.BatchNorm1d(width), _Layer(width, width)

    def forward(self, own: tuple[Tensor, Tensor], rooms: tuple[Tensor, Tensor], owner: Tensor) -> Tensor:
        of_rooms = self.room(rooms).unflatten(0, (2, -1))
        rows = self.own(own) + of_rooms[:, owner].flatten(0, 1)
        hidden: Tensor = self.layer(torch.relu(_normalised(self.norm, rows)))
        return hidden


class _Context(nn.Module):
    def __init__(self, room: int, before: int, width: int) -> None:
        super().__init__()
        self.room, self.layer = nn.Linear(room, width, bias=False), _Layer(before, width)

    def forward(self, rows: Tensor, room: Tensor, owner: Tensor) -> Tensor:
        hidden: Tensor = self.layer(rows, self.room(room)[owner])
        return hidden


def _normalised(norm: nn.BatchNorm1d, rows: Tensor) -> Tensor:
    """Normalised rows; a batch of fewer than two has no deviation and is normalised by the running ones."""
    if norm.training and len(rows) < 2:
        return nn.functional.batch_norm(rows, norm.running_mean, norm.running_var, norm.weight, norm.bias, eps=norm.eps)
    normalised: Tensor = norm(rows)
    return normalised
