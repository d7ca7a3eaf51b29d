"""Which networks drove: their digests and the settings they were made with, wherever they were trained."""

from collections.abc import Mapping
from typing import Any

from pipeline.evaluation.cost_table import NOT_FORMED
from pipeline.reports import markup

ELSEWHERE = (
    "These networks were trained elsewhere: nothing was harvested or trained for this evaluation, and what they were "
    "made with is what their own files say."
)


def networks(summary: Mapping[str, Any], *, elsewhere: bool) -> list[str]:
    """Return a table with a column for each competitor that drove with weights: digest, then settings by name.

    elsewhere: none of them comes from this run's training.
    """
    found = [each for each in summary["competitors"].values() if each.get("weights")]
    if not found:
        return []
    made = [each.get("made_with") or {} for each in found]
    names = sorted({name for settings in made for name in settings})
    rows = [("weights, SHA-256", *(each["weights"] for each in found))]
    rows += [(name, *(_shown(settings, name) for settings in made)) for name in names]
    head = ("made with", *(each["title"] for each in found))
    return [*([markup.paragraph(ELSEWHERE)] if elsewhere else []), markup.table(head, rows)]


def _shown(settings: Mapping[str, Any], name: str) -> str:
    value = settings.get(name)
    if isinstance(value, list):
        return ", ".join(map(str, value))
    return NOT_FORMED if value is None else str(value)
