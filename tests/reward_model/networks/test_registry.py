import inspect
import json
import math
import re
import subprocess
import sys

import pytest

from reward_model.base.lazy import entry_point
from reward_model.networks.edge_networks import EDGE_NETWORKS
from reward_model.networks.registry import NETWORKS, GATConfig, MPNNConfig, RGCNConfig, network_config


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"kind": "mpnn", "edge_network": "perceptron", "num_bases": 3}, "num_bases is no option of mpnn, which takes"),
        ({"kind": "rgcn", "num_bases": 3, "num_heads": 3}, "num_heads is no option of rgcn, which takes"),
        ({"kind": "rgcn", "num_bases": 0}, "num_bases must be at least 1, got 0"),
        ({"kind": "gat", "num_heads": 2, "negative_slope": -1.0}, "negative_slope must lie in 0..1, 1 excluded, got"),
        ({"kind": "gat", "num_heads": 2, "dropout": math.nan}, "dropout must lie in 0..1, 1 excluded, got nan"),
        ({"kind": "mpnn", "edge_network": "deep"}, "edge_network must be one of ['perceptron', 'tabulated'], got"),
        ({"kind": "gan"}, f"network kind must be one of {sorted(NETWORKS)}, got 'gan'"),
    ],
)
def test_impossible_configs(values, message):
    options = {name: value for name, value in values.items() if name != "kind"}
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        network_config(values["kind"], (42, 2), options)


@pytest.mark.parametrize(
    ("config", "document"),
    [
        (
            RGCNConfig((42, 6, 2), num_bases=4, dropout=0.5),
            '{"kind": "rgcn", "sizes": [42, 6, 2], "num_bases": 4, "dropout": 0.5}',
        ),
        (
            GATConfig((42, 6, 2), num_heads=3, negative_slope=0.1),
            '{"kind": "gat", "sizes": [42, 6, 2], "num_heads": 3, "negative_slope": 0.1, "dropout": 0.0}',
        ),
        (
            MPNNConfig((42, 2), "perceptron"),
            '{"kind": "mpnn", "sizes": [42, 2], "edge_network": "perceptron"}',
        ),
    ],
)
def test_configs_as_checkpoints_have_them(config, document):
    assert json.dumps(config.document()) == document


def test_options_have_the_defaults_of_the_command_line():
    assert network_config("rgcn", (42, 2), {}) == RGCNConfig((42, 2), num_bases=8, dropout=0.0)
    assert network_config("gat", (42, 2), {}) == GATConfig((42, 2), num_heads=4, negative_slope=0.2, dropout=0.0)
    assert network_config("mpnn", (42, 2), {}) == MPNNConfig((42, 2), edge_network="tabulated")
    assert sorted(EDGE_NETWORKS) == MPNNConfig.option_fields()["edge_network"].choices


@pytest.mark.parametrize("kind", sorted(NETWORKS))
def test_entries_name_what_there_is(kind):
    network = NETWORKS[kind]
    if network.on_dgl:
        pytest.importorskip("dgl")
    for name in filter(None, (network.definition, network.trained)):
        parameters = list(inspect.signature(entry_point(name)).parameters)
        assert parameters == ["sizes", *network.config.option_fields()]
    if network.compiled:
        assert callable(entry_point(network.compiled))


def test_the_registry_and_what_the_command_line_makes_of_it_load_no_framework():
    code = (
        "import sys, reward_model.networks.registry, reward_model.networks.option_fields\n"
        "import reward_model.studies.search_space\n"
        "assert not {'torch', 'dgl', 'numba', 'numpy', 'optuna'} & sys.modules.keys()\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
