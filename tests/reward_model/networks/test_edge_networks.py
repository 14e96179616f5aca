import numpy as np
import pytest
import torch

from reward_model.graph.features import LENGTH_FEATURE, NUM_EDGE_FEATURES, Relation
from reward_model.networks.edge_networks import (
    IN_METRES,
    MEASURED,
    PLAIN,
    PerceptronEdgeNetwork,
    TabulatedEdgeNetwork,
    interpolate,
)


def edge(relation: Relation, length: float) -> torch.Tensor:
    features = torch.zeros(NUM_EDGE_FEATURES)
    features[relation] = 1
    features[LENGTH_FEATURE] = length
    return features


def from_operators(operators, relation: Relation, length: float) -> torch.Tensor:
    if relation in PLAIN:
        return operators.plain[PLAIN.index(relation)]
    index = MEASURED.index(relation)
    weights = interpolate(operators.knots[index], operators.coefficients[index], torch.tensor([length]))[0]
    return torch.einsum("k,kio->io", weights, operators.basis[index])


def all_edges() -> list[tuple[Relation, float]]:
    """Every relation at some of its lengths, up to the longest that rooms have."""
    measured = [(r, x * (1.5 if r in IN_METRES else 0.78)) for r in MEASURED for x in (0.0, 0.031, 0.4, 1.0)]
    return [*measured, *((relation, 0.0) for relation in PLAIN)]


def test_every_relation_has_its_matrix():
    assert sorted((*MEASURED, *PLAIN)) == list(range(18))
    assert [relation.name for relation in PLAIN if relation > Relation.WALL_ROOM] == [
        "NOW_TO_SECOND",
        "SECOND_TO_NOW",
        "SECOND_TO_THIRD",
        "THIRD_TO_SECOND",
    ]


def test_the_perceptrons_hidden_sizes_are_the_published_ones():
    sizes = [
        [layer.out_features for layer in PerceptronEdgeNetwork(*pair) if isinstance(layer, torch.nn.Linear)]
        for pair in ((42, 40), (12, 3), (3, 2))
    ]
    assert sizes == [[573, 1124, 1680], [24, 29, 36], [13, 10, 6]]


@pytest.mark.parametrize("make", [PerceptronEdgeNetwork, TabulatedEdgeNetwork])
def test_operators_give_the_matrices_that_edges_have(make):
    torch.manual_seed(0)
    network = make(5, 4)
    if make is TabulatedEdgeNetwork:
        torch.nn.init.normal_(network.tables)
    bias = torch.arange(4.0)
    operators = network.operators(bias)
    with torch.no_grad():
        for relation, length in all_edges():
            matrix = network(edge(relation, length).unsqueeze(0)).reshape(5, 4)
            torch.testing.assert_close(from_operators(operators, relation, length), matrix, atol=2e-6, rtol=0)
    assert operators.bias.tolist() == [0, 1, 2, 3]


def test_tabulated_matrices_are_read_between_and_beyond_the_knots():
    network = TabulatedEdgeNetwork(1, 1)
    with torch.no_grad():
        network.tables[:] = torch.arange(8.0).reshape(1, 8, 1, 1)  # knot k has the value k
        lengths = {0.0: 0.0, 0.05: 1.0, 0.075: 1.5, 0.15: 3.0, 0.2: 3.5, 0.55: 5.5, 1.2: 7.0, 1.7: 8.0}
        for length, value in lengths.items():
            assert network(edge(Relation.WALL_ROOM, length)[None]).item() == pytest.approx(value, abs=1e-5)
        for length, value in {0.0625: 1.0, 0.25: 3.5, 1.5: 7.0}.items():  # m, knots 1.25 times as far apart
            assert network(edge(Relation.PERSON_WALL, length)[None]).item() == pytest.approx(value, abs=1e-5)


def test_the_few_speak_up_to_the_room():
    network = TabulatedEdgeNetwork(1, 1)
    torch.nn.init.constant_(network.tables, 0.5)
    with torch.no_grad():
        gains = {r.name: network(edge(r, 0.2)[None]).item() / 0.5 for r in MEASURED if r.name.endswith("_ROOM")}
    assert gains == pytest.approx({"GOAL_ROOM": 20, "OBJECT_ROOM": 5, "PERSON_ROOM": 5, "WALL_ROOM": 1})


def test_interpolation_goes_straight_on_beyond_the_table():
    knots, table = torch.tensor([0.0, 0.5, 2.0]), torch.tensor([[0.0, 5.0], [2.0, 5.0], [8.0, 7.0]])
    values = interpolate(knots, table, torch.tensor([[0.0, 0.25, 0.5], [0.875, 2.0, 3.5]]))
    np.testing.assert_allclose(values[0], [[0, 5], [1, 5], [2, 5]], atol=1e-6)
    np.testing.assert_allclose(values[1], [[3.5, 5.5], [8, 7], [14, 9]], atol=1e-6)


def test_perceptrons_are_followed_from_bend_to_bend():
    network = PerceptronEdgeNetwork(1, 2)
    for parameter in network.parameters():
        torch.nn.init.zeros_(parameter)
    first, second, last = network[0], network[2], network[4]
    with torch.no_grad():
        first.weight[0, LENGTH_FEATURE], first.bias[0] = 1, -0.25  # comes in at 0.25
        first.weight[1, LENGTH_FEATURE], first.bias[1] = -2, 1  # goes out at 0.5
        first.weight[1, Relation.ROOM_WALL] = 2  # but at 1.5 here
        second.weight[0, 0], second.bias[0] = 4, -3  # comes in at 1
        second.weight[1, 1] = 1
        last.weight[0, 0], last.weight[1, 1] = 1, 3
    operators = network.operators(torch.zeros(2))
    knots = {relation: operators.knots[MEASURED.index(relation)].tolist() for relation in MEASURED}
    assert knots[Relation.WALL_ROOM] == pytest.approx([0, 0.25, 0.5, 1, 2])
    assert knots[Relation.ROOM_WALL] == pytest.approx([0, 0.25, 1, 1.5, 2])
    assert knots[Relation.PERSON_WALL] == pytest.approx([0, 0.25, 0.5, 1, 1.5])
    assert knots[Relation.PERSON_PERSON] == pytest.approx([0, 0.25, 0.5, 0.8, 1.6])  # on beyond its reach
    for length in (0.1, 0.3, 0.7, 1.9, 2.5):
        matrix = from_operators(operators, Relation.WALL_ROOM, length).flatten().tolist()
        assert matrix == pytest.approx([max(0, 4 * (length - 0.25) - 3), 3 * max(0, 1 - 2 * length)], abs=1e-5)


def test_gradients_reach_the_tables():
    network = TabulatedEdgeNetwork(2, 3)
    operators = network.operators(torch.zeros(3))
    from_operators(operators, Relation.PERSON_PERSON, 0.075).sum().backward()
    slopes = network.tables.grad[MEASURED.index(Relation.PERSON_PERSON)]
    np.testing.assert_allclose(slopes[:, 0, 0], [0, 0.5, 0.5, 0, 0, 0, 0, 0], atol=1e-6)
    assert network.tables.grad[MEASURED.index(Relation.PERSON_OBJECT)].abs().sum() == 0
