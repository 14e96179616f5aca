"""The results of a search as the paper tabulates them, in Markdown, CSV and JSON, and a list of all sessions."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from reward_model.base.files import replace_file
from reward_model.networks.registry import NETWORKS
from reward_model.training.parallel import FAILED

RESULTS: Final = "results"  # .md, .csv and .json
SESSIONS_FILE: Final = "sessions.csv"
_HEADINGS: Final = ("block", "sessions", "session", "train", "development", "test", "epochs", "parameters")


class Finished(NamedTuple):
    """A session that is over: its number, what was drawn for it, and what it resulted in."""

    number: int
    params: dict[str, Any]
    result: dict[str, Any]

    @property
    def development(self) -> float:
        """Its mean squared error on the development part, the mean of both questions; inf where it failed."""
        return math.inf if FAILED in self.result else float(self.result["development_error"])

    @property
    def row(self) -> dict[str, Any]:
        """What the tables say of it, errors None where they do not exist."""
        numbers = {"train": "train_error", "development": "development_error", "epochs": "epochs"}
        found = {name: self.result.get(key) for name, key in (*numbers.items(), ("parameters", "parameters"))}
        tested = list(self.result.get("test_error", {}).values())
        return {"session": self.number, **found, "test": float(np.mean(tested)) if tested else None, **self.params}


def best_of_blocks(rows: Sequence[Finished]) -> list[dict[str, Any]]:
    """Each block's session of the smallest development error: `Finished.row`, and of how many `sessions` it is best."""
    found = []
    for block in NETWORKS:
        own = [row for row in rows if row.params["block"] == block]
        if own and math.isfinite(min(row.development for row in own)):
            found.append({"sessions": len(own), **min(own, key=lambda row: row.development).row})
    return found


def markdown(best: Sequence[dict[str, Any]]) -> str:
    """The paper's table: a block's best session with its mean squared errors, and what was drawn for it."""
    lines = [f"| {' | '.join(_HEADINGS)} | drawn |", "|---" * (len(_HEADINGS) + 1) + "|"]
    for row in best:
        drawn = {name: value for name, value in row.items() if name not in _HEADINGS}
        cells = [NETWORKS[row["block"]].title, *(_cell(row[name]) for name in _HEADINGS[1:])]
        lines.append(f"| {' | '.join(cells)} | {', '.join(f'{n} {_cell(v)}' for n, v in drawn.items())} |")
    return "\n".join(lines) + "\n"


def write_reports(rows: Sequence[Finished], output: Path) -> None:
    """Write all files anew. Raises `OSError` where that cannot be done; each is then the old one or the new one."""
    best = best_of_blocks(rows)
    replace_file(output / f"{RESULTS}.md", markdown(best).encode())
    replace_file(output / f"{RESULTS}.json", (json.dumps(best, indent=2) + "\n").encode())
    replace_file(output / f"{RESULTS}.csv", _csv(best))
    replace_file(output / SESSIONS_FILE, _csv([row.row for row in rows]))


def _csv(rows: Sequence[dict[str, Any]]) -> bytes:
    names = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    table = csv.DictWriter(text, names, lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue().encode()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if not isinstance(value, float):
        return str(value)
    return f"{value:.6f}" if value >= 1e-3 else f"{value:.3g}"
