from dataclasses import dataclass, field

import pytest

from socnav_env.config import EnvConfig
from socnav_env.config.reference import Entry, entries


@dataclass(frozen=True)
class Part:
    """A part.

    Attributes:
        least, most: [m] of something that needs two lines
            to be said
    """

    least: float = 1.0
    most: float | None = None


@dataclass(frozen=True)
class Whole:
    """Everything.

    part: is no entry here.

    Attributes:
        name: of it: any

    Nothing of this belongs to an entry.
        Nor does this.
    """

    name: str = "x"
    part: Part = field(default_factory=Part)


def test_keys_come_with_defaults_and_meanings() -> None:
    meaning = "[m] of something that needs two lines to be said"
    assert list(entries(Whole())) == [
        Entry("name", '"x"', "of it: any"),
        Entry("part.least", "1.0", meaning),
        Entry("part.most", "null", meaning),
    ]


def test_a_key_that_nobody_explains_is_named() -> None:
    @dataclass(frozen=True)
    class Silent:
        """Nothing: said."""

        volume: float = 0.0

    with pytest.raises(ValueError, match="the docstring of Silent must say what volume means"):
        list(entries(Silent()))


def test_the_whole_configuration_is_explained() -> None:
    found = {entry.key: entry for entry in entries(EnvConfig())}
    assert found["robot.drive"].default == '"differential"'
    assert found["sensors.lidar_beams"].default == "64"
    assert found["control_period"].meaning == "[s] from one action to the next"
    assert len(found) > 80
