"""Generators of anybody's: a function that draws one plan, named by its place."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.errors import PartError
from pipeline.floorplans.generators import GENERATORS
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.parts import Part, find_part, make_part, settings_of

KEY = "plans.source"


def find_generator(use: str, settings: Mapping[str, Any]) -> tuple[Part, Any]:
    """Return the function at ``use``, ``package.module:function``, and its typed ``settings``.

    It is called as ``draw(settings, rng, plan_id, split)`` and takes of these what it names; ``rng`` and the settings
    alone decide what comes out.

    Raises:
        ConfigError, PartError: there is no such function, its module fails, or it takes other settings.
    """
    part = find_part(KEY, use, dict.fromkeys(GENERATORS, ""))
    return part, settings_of(part, settings, "plans.source_settings")


def draw_own(part: Part, settings: Any, rng: np.random.Generator, *, plan_id: str, split: str) -> FloorPlan | GridPlan:
    """Return the plan that ``part`` draws; ``rng`` is consumed.

    Raises:
        PartError: it fails, returns something else, or names the plan or its split otherwise than asked.
    """
    plan = make_part(part, settings, expected=object, rng=rng, plan_id=plan_id, split=split)
    if not isinstance(plan, FloorPlan | GridPlan):
        raise PartError(f"{part} drew no plan but a {type(plan).__name__}: expected a FloorPlan or a GridPlan")
    if (plan.plan_id, plan.split) != (plan_id, split):
        raise PartError(
            f"{part} drew plan {plan.plan_id!r} for the split {plan.split}, asked for {plan_id!r} for {split}: hand on "
            "plan_id and split as they come"
        )
    return plan
