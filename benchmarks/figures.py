"""Figures of benchmarks: printing and writing them."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from reward_model.base.files import replace_file

BEGIN, END = "<!-- figures -->", "<!-- end of figures -->"


@dataclass(frozen=True)
class Figure:
    """One measured quantity.

    Attributes:
        section: the table that it belongs to
        name: of the quantity
        unit: of the values
        values: one of each run, or of each step
    """

    section: str
    name: str
    unit: str
    values: Sequence[float]

    @property
    def median(self) -> float:
        """The median of the values."""
        return median(self.values)


def print_figures(console: Console, figures: Sequence[Figure], methods: dict[str, str]) -> None:
    """Print a table for each section, titled with its method."""
    for section in dict.fromkeys(figure.section for figure in figures):
        table = Table(title=f"{section}: {methods[section]}", title_justify="left", title_style="")
        for heading in ("", "median", "5 %", "95 %", "unit"):
            table.add_column(heading, justify="left" if heading in ("", "unit") else "right")
        for figure in figures:
            if figure.section == section:
                table.add_row(figure.name, *_summary(figure), figure.unit)
        console.print(table)


def write_figures(path: Path, figures: Sequence[Figure], methods: dict[str, str]) -> None:
    """Write figures as JSON, with a description of the machine."""
    machine = {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "python": platform.python_version(),
        "numba": numba.__version__,
        "numpy": np.__version__,
    }
    rows = [{**asdict(figure), "median": figure.median, "method": methods[figure.section]} for figure in figures]
    replace_file(path, (json.dumps({"machine": machine, "figures": rows}, indent=2) + "\n").encode())


def document_figures(path: Path, figures: Sequence[Figure], methods: dict[str, str]) -> None:
    """Replace the text between the lines BEGIN and END of a Markdown file by a table for each section."""
    before, _, rest = path.read_text().partition(BEGIN)
    _, found, after = rest.partition(END)
    if not found:
        raise ValueError(f"{path} must have the lines {BEGIN} and {END}")
    lines = [f"{_processor()}, {os.cpu_count()} cores, Python {platform.python_version()}."]
    for section in dict.fromkeys(figure.section for figure in figures):
        lines += [
            "",
            f"**{section}**: {methods[section]}.",
            "",
            "| | median | 5 % | 95 % | |",
            "|---|---:|---:|---:|---|",
        ]
        for figure in figures:
            if figure.section == section:
                lines.append(f"| {figure.name} | {' | '.join(_summary(figure))} | {figure.unit} |")
    table = "\n".join(lines)
    replace_file(path, f"{before}{BEGIN}\n\n{table}\n\n{END}{after}".encode())


def _summary(figure: Figure) -> list[str]:
    """The median, and the 5th and 95th percentiles."""
    return [_shown(number) for number in (figure.median, *np.percentile(figure.values, [5, 95]).tolist())]


def _shown(number: float) -> str:
    return f"{number:,.0f}" if abs(number) >= 100 else f"{number:.3g}"


def _processor() -> str:
    """The processor's name, on Linux from /proc/cpuinfo."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text().splitlines() if path.is_file() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
