"""The features extractor: what it reads, and what must not matter to it."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from gymnasium import spaces

from agents.features.extractor import EntityFeatures, closest_on_boxes, closest_on_segments, corridor, greatest, polar
from tests.agents.disc import CAPACITIES, WIDTHS, entities_space


@pytest.fixture
def extractor() -> EntityFeatures:
    torch.manual_seed(0)
    return EntityFeatures(entities_space(), hidden=16)


def observations(presence: float = 1.0) -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(1)
    batch = {"robot": torch.randn(5, 4, generator=generator), "goal": torch.randn(5, 2, generator=generator)}
    for kind, capacity in CAPACITIES.items():
        mask = torch.full((5, capacity), presence)
        rows = torch.randn(5, capacity, WIDTHS[kind], generator=generator)
        batch[kind], batch[f"{kind}_mask"] = (rows * mask[..., None]).flatten(1), mask
    return batch


@pytest.mark.parametrize("kind", CAPACITIES)
def test_order_of_rows_changes_nothing(extractor: EntityFeatures, kind: str) -> None:
    batch = observations()
    batch[f"{kind}_mask"][:, 0] = 0.0
    order = torch.arange(CAPACITIES[kind]).flip(0)
    moved = dict(batch)
    moved[kind] = batch[kind].unflatten(1, (CAPACITIES[kind], -1))[:, order].flatten(1)
    moved[f"{kind}_mask"] = batch[f"{kind}_mask"][:, order]
    torch.testing.assert_close(extractor(moved), extractor(batch))


@pytest.mark.parametrize("kind", CAPACITIES)
def test_masked_rows_change_nothing_and_others_do(extractor: EntityFeatures, kind: str) -> None:
    batch = observations()
    shifted = {**batch, kind: batch[kind].clone()}
    shifted[kind][:, : WIDTHS[kind]] += 3.0
    assert not torch.allclose(extractor(shifted), extractor(batch))
    batch[f"{kind}_mask"][:, 0] = 0.0
    torch.testing.assert_close(extractor(shifted), extractor(batch))


def test_empty_sets_are_finite(extractor: EntityFeatures) -> None:
    batch = {**observations(presence=0.0), "goal": torch.zeros(5, 2)}
    features = extractor(batch)
    assert features.shape == (5, 6 * 16)
    assert torch.isfinite(features).all()
    features.sum().backward()
    assert all(torch.isfinite(weight.grad).all() for weight in extractor.parameters() if weight.grad is not None)


def test_kinds_that_a_configuration_rules_out_are_left_away() -> None:
    space = spaces.Dict({key: box for key, box in entities_space().items() if not key.startswith(("people", "inter"))})
    batch = observations()
    features = EntityFeatures(space, hidden=8)({key: batch[key] for key in space})
    assert features.shape == (5, 4 * 8)
    alone = spaces.Dict({key: space[key] for key in ("robot", "goal")})
    assert EntityFeatures(alone, hidden=8)({key: batch[key] for key in alone}).shape == (5, 16)


def test_polar_of_a_point_to_the_left() -> None:
    described = polar(torch.tensor([0.0, 0.7]))
    np.testing.assert_allclose(described, [0.0, 0.14, 0.0, 1.0, 0.14, 1.0], atol=1e-5)


def test_what_is_in_the_way_to_a_goal_on_the_left() -> None:
    goal = torch.tensor([[0.0, 4.0]])
    points = torch.tensor([[[0.0, 2.0], [1.0, 2.0], [-3.0, 1.0]]])
    expected = [[[1.5, 0.0, 0.4], [1.5, -1.0, 0.4], [1.0, 1.5, 0.2]]]
    np.testing.assert_allclose(corridor(points, goal), expected, atol=1e-5)


@pytest.mark.parametrize(
    ("segment", "closest"),
    [
        ([1.0, -1.0, 1.0, 1.0], [1.0, 0.0]),
        ([1.0, 2.0, 3.0, 2.0], [1.0, 2.0]),
        ([3.0, 1.0, 2.0, 1.0], [2.0, 1.0]),
        ([0.0, 0.0, 0.0, 0.0], [0.0, 0.0]),
    ],
)
def test_closest_point_of_a_segment(segment: list[float], closest: list[float]) -> None:
    np.testing.assert_allclose(closest_on_segments(torch.tensor(segment)), closest, atol=1e-5)


@pytest.mark.parametrize(
    ("box", "closest"),
    [
        ([2.0, 0.0, 1.0, 0.0, 1.0, 0.4], [1.5, 0.0]),
        ([2.0, 0.0, 0.0, 1.0, 1.0, 0.4], [1.8, 0.0]),
        ([2.0, 2.0, 1.0, 0.0, 1.0, 0.4], [1.5, 1.8]),
        ([0.1, 0.0, 1.0, 0.0, 1.0, 1.0], [0.0, 0.0]),
    ],
)
def test_closest_point_of_a_box(box: list[float], closest: list[float]) -> None:
    np.testing.assert_allclose(closest_on_boxes(torch.tensor(box)), closest, atol=1e-5)


def test_equal_rows_share_the_gradient_of_the_greatest() -> None:
    rows = torch.tensor([[1.0, 5.0], [3.0, 2.0], [3.0, 4.0], [0.5, 0.5]], requires_grad=True)
    counts = torch.tensor([3, 0, 1])
    pooled = greatest(rows, counts)
    assert pooled.tolist() == [[3.0, 5.0], [0.0, 0.0], [0.5, 0.5]]
    (gradient,) = torch.autograd.grad(pooled.sum(), rows)
    assert gradient.tolist() == [[0.0, 1.0], [0.5, 0.0], [0.5, 0.0], [1.0, 1.0]]
