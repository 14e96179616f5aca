"""What tests of every package share: the recorded data and the published weights, where they can be had."""

import os
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the recorded data: SOCNAV_DATA, or ../shared/data beside the project."""
    folder = Path(os.environ.get("SOCNAV_DATA") or PROJECT.parent / "shared" / "data")
    if not folder.is_dir():
        pytest.skip(f"the recorded data is not at {folder}; SOCNAV_DATA names another place")
    return folder


@pytest.fixture(scope="session")
def published_weights(tmp_path_factory: pytest.TempPathFactory):
    """Make load_scorer("published") work, from the user's cache or by fetching the weights for this run."""
    from reward_model.networks.checkpoint import CheckpointError
    from reward_model.published import REQUIREMENT, PublishedWeightsError, import_published
    from reward_model.scorer import weights_path

    with pytest.MonkeyPatch.context() as patch:
        try:
            weights_path("published")
        except CheckpointError:
            patch.setenv("SOCNAV_CACHE", str(tmp_path_factory.mktemp("cache")))
            patch.setenv("PIP_RETRIES", "0")
            patch.setenv("PIP_DEFAULT_TIMEOUT", "15")
            try:
                import_published(REQUIREMENT)
            except PublishedWeightsError as error:
                pytest.skip(f"the published weights cannot be had: {error}")
        yield
