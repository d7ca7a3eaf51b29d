"""What an author switched off, clipped or left in another file; blocks and their layers."""

import pytest
from ezdxf.xclip import XClip

from pipeline.floorplans.readers.dxf import Dxf
from tests.floorplans.readers.drawing_samples import check_house, contains, refusal
from tests.floorplans.readers.dxf_samples import OPENING, WALL, Sheet, read

ACROSS = [(7.0, 0.0), (7.0, 4.0)]  # a wall through the hall
TAKEN = "layers taken: walls from A-WALL; doors from A-DOOR"


def house() -> Sheet:
    return Sheet().walls().door()


def hidden(count: int, layers: str) -> str:
    return f"{count} {'entity' if count == 1 else 'entities'} switched off, frozen or invisible passed over, {layers}"


def is_open(plan) -> bool:
    """The hall is not parted at x = 7 m."""
    return contains(plan, [(7, 1), (7, 3)]) == [True, True]


@pytest.mark.parametrize("state", ["off", "freeze"])
@pytest.mark.parametrize("written", ["A-WALL-OLD", "a-wall-old"])
def test_layers_that_are_switched_off_are_passed_over(tmp_path, state, written):
    sheet = house().lines(ACROSS, layer=written).lines([(8, 1), (9, 3)], layer="A-WALL-OLD")
    getattr(sheet.document.layers.add("A-WALL-OLD", color=5), state)()
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert is_open(plan)
    assert contains(plan, [(8.5, 2)]) == [True]
    assert plan.remarks[1].startswith("2 entities switched off, frozen or invisible passed over, on layers A-WALL-OLD")


def test_a_layer_that_is_not_plotted_or_locked_is_seen(tmp_path):
    sheet = house().lines(ACROSS, layer="A-WALL-NEW")
    layer = sheet.document.layers.add("A-WALL-NEW")
    layer.dxf.plot = 0
    layer.lock()
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(7, 1)]) == [False]
    assert plan.remarks == ("layers taken: walls from A-WALL, A-WALL-NEW; doors from A-DOOR",)


def test_invisible_entities_are_passed_over(tmp_path):
    sheet = house().lines(ACROSS, **WALL, invisible=1).lines([(5, 3), (6, 3)], **WALL, invisible=0)
    sheet.arc((9.0, 4.0), 180, 270, invisible=1)
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert is_open(plan)
    assert contains(plan, [(5.5, 3)]) == [False]
    assert plan.remarks == (TAKEN, hidden(2, "on layers A-DOOR, A-WALL"))


def with_block(place: dict, *, state: str | None = None, layer: str = "X-REF", inner: str | None = None) -> Sheet:
    """A block of a wall on layer 0 at x = 7 m and one on A-WALL at x = 9 m, put in as ``place`` says."""
    sheet = house()
    block = sheet.document.blocks.new("BITS")
    block.add_line((7, 0), (7, 4))
    block.add_line((9, 1), (9, 3), dxfattribs=WALL)
    if state is not None:
        layers = sheet.document.layers
        getattr(layers.get(layer) if layer in layers else layers.add(layer, color=2), state)()
    if inner is not None:
        sheet.document.blocks.new("NEST").add_blockref("BITS", (0, 0), dxfattribs={"layer": inner})
    sheet.space.add_blockref("BITS" if inner is None else "NEST", (0, 0), dxfattribs=place)
    return sheet


@pytest.mark.parametrize(
    ("state", "layer", "inner", "shown"),
    [
        (None, "WALLS", None, (True, True)),
        ("off", "WALLS", None, (False, True)),
        ("freeze", "WALLS", None, (False, False)),
        (None, "WALLS", "0", (True, True)),
        ("off", "WALLS", "0", (False, True)),
        ("freeze", "WALLS", "0", (False, False)),
        ("off", "WALLS", "MURS", (True, True)),
        ("freeze", "WALLS", "MURS", (False, False)),
    ],
)
def test_a_frozen_reference_hides_all_and_an_off_one_what_takes_its_layer(tmp_path, state, layer, inner, shown):
    plan = read(with_block({"layer": layer}, state=state, layer=layer, inner=inner).save(tmp_path))
    assert contains(plan, [(7, 1), (9, 2)]) == [not shown[0], not shown[1]]
    missing = shown.count(False)
    assert (len(plan.remarks) == 2) is (missing > 0)
    if missing:
        assert plan.remarks[1] == hidden(missing, f"on layers {layer}")


def test_a_nested_reference_on_a_frozen_layer_hides_what_it_holds(tmp_path):
    plan = read(with_block({"layer": "WALLS"}, state="freeze", layer="MURS", inner="MURS").save(tmp_path))
    assert contains(plan, [(7, 1), (9, 2)]) == [True, True]
    assert plan.remarks[1] == hidden(2, "on layers MURS")


def test_an_invisible_reference_hides_what_it_holds(tmp_path):
    plan = read(with_block({"layer": "WALLS", "invisible": 1}).save(tmp_path))
    assert contains(plan, [(7, 1), (9, 2)]) == [True, True]
    assert plan.remarks[1] == hidden(2, "on layers WALLS")


def test_layer_0_of_a_block_is_seen_although_layer_0_is_frozen(tmp_path):
    plan = read(with_block({"layer": "WALLS"}, state="freeze", layer="0").save(tmp_path))
    assert contains(plan, [(7, 1), (9, 2)]) == [False, False]


def test_a_drawing_whose_walls_are_all_switched_off_says_so(tmp_path):
    sheet = house()
    sheet.document.layers.add("A-WALL").freeze()
    text = refusal(Dxf(), sheet.save(tmp_path))
    assert "no wall on layers named for walls" in text
    assert "7 entities switched off, frozen or invisible passed over, on layers A-WALL." in text


# Clips
BAR = [(0.0, 2.0), (10.0, 2.0)]


def clipped(sheet: Sheet, corners, *, place=(0, 0), nested=False, **attribs) -> XClip:
    """A block of one long wall along the hall at y = 2 m, clipped to ``corners`` in its own coordinates."""
    block = sheet.document.blocks.new("BAR")
    block.add_line(*BAR, dxfattribs=WALL)
    space = sheet.document.blocks.new("HOLDER") if nested else sheet.space
    clip = XClip(space.add_blockref("BAR", place, dxfattribs=attribs))
    clip.set_block_clipping_path(corners)
    if nested:
        sheet.space.add_blockref("HOLDER", (-3.0, 0.0), dxfattribs={"layer": "X"})
    return clip


def bar(plan) -> list[bool]:
    """Where along the hall the bar stands: at 1, 3, 5, 7 and 9 m."""
    return [not free for free in contains(plan, [(x, 2) for x in (1, 3, 5, 7, 9)])]


def test_a_clip_shows_what_lies_in_it(tmp_path):
    sheet = house()
    clipped(sheet, [(2.0, 0.0), (6.0, 3.0)])
    plan = read(sheet.save(tmp_path))
    assert bar(plan) == [False, True, True, False, False]
    assert plan.remarks[1] == "1 entity cut off at the clip of a block, on layers A-WALL"


def test_a_clip_may_have_any_shape(tmp_path):
    sheet = house()
    clipped(sheet, [(0, 0), (4, 0), (4, 3), (6, 3), (6, 0), (8, 0), (8, 4), (0, 4)])  # its notch is x 4 to 6, y 0 to 3
    assert bar(read(sheet.save(tmp_path))) == [True, True, False, True, False]


def test_the_clip_moves_with_its_block(tmp_path):
    sheet = house()
    clipped(sheet, [(0.5, -4.0), (1.5, 9.0)], place=(1, 0), xscale=4.0)  # x = 1 + 4 * (0.5 to 1.5): 3 to 7
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(2, 2), (4, 2), (6, 2), (8, 2)]) == [True, False, False, True]


def test_the_clip_of_a_block_within_another_counts_too(tmp_path):
    sheet = house()
    clipped(sheet, [(2.0, 0.0), (6.0, 3.0)], place=(3.5, 0), nested=True)  # shown from 2.5 to 6.5
    assert bar(read(sheet.save(tmp_path))) == [False, True, True, False, False]


def test_a_clip_that_is_switched_off_cuts_nothing(tmp_path):
    sheet = house()
    clipped(sheet, [(2.0, 0.0), (6.0, 3.0)]).disable_clipping()
    plan = read(sheet.save(tmp_path))
    assert bar(plan) == [True] * 5
    assert plan.remarks == (TAKEN,)


def test_an_inverted_clip_shows_what_lies_around_it(tmp_path):
    sheet = house()
    clip = clipped(sheet, [(2.0, 0.0), (6.0, 3.0)])
    clip.invert_clipping_path([(-1, -1), (11, 5)], ignore_acad_compatibility=True)
    plan = read(sheet.save(tmp_path))
    assert bar(plan) == [True, False, False, True, True]
    assert plan.remarks[1] == "1 entity cut off at the clip of a block, on layers A-WALL"


def test_a_door_beyond_the_clip_is_none(tmp_path):
    sheet = Sheet().walls()
    block = sheet.document.blocks.new("DOORS")
    for x in (1.0, 2.5):
        block.add_line((x, 4.0), (x, 4.9), dxfattribs=OPENING)
        block.add_arc((x, 4.0), 0.9, 0, 90, dxfattribs=OPENING)
    XClip(sheet.space.add_blockref("DOORS", (0, 0))).set_block_clipping_path([(0.0, 3.0), (2.2, 6.0)])
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert plan.remarks[1] == "2 entities cut off at the clip of a block, on layers A-DOOR"


# What is elsewhere
def xref(sheet: Sheet, path: str, name: str = "SHELL", **attribs) -> Sheet:
    sheet.document.add_xref_def(path, name)
    sheet.space.add_blockref(name, (0, 0), dxfattribs=attribs)
    return sheet


def test_external_references_are_named(tmp_path):
    sheet = xref(xref(house(), "..\\base\\shell.dwg", layer="X"), "core.dxf", "CORE", layer="0")
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert plan.remarks[1:] == (
        "2 external references are not read: ..\\base\\shell.dwg, core.dxf (bind them into the drawing)",
    )


def test_a_drawing_of_references_alone_says_which(tmp_path):
    text = refusal(Dxf(), xref(Sheet(), "shell.dxf", layer="A-WALL").save(tmp_path))
    assert "1 external reference is not read: shell.dxf" in text
    assert "Bind external references into the drawing" in text


def test_references_on_frozen_layers_are_not_missed(tmp_path):
    sheet = xref(house(), "shell.dxf", layer="X")
    sheet.document.layers.add("X").freeze()
    assert not any("external" in remark for remark in read(sheet.save(tmp_path)).remarks)


def test_layers_of_bound_references_are_known(tmp_path):
    sheet = Sheet().lines([(0, 0), (8, 0), (8, 5), (0, 5)], closed=True, layer="shell$0$A-WALL")
    plan = read(sheet.lines([(3, 0), (3, 5)], layer="core|walls").save(tmp_path))
    assert contains(plan, [(3, 2), (4, 2)]) == [False, True]
    assert plan.remarks == ("layers taken: walls from core|walls, shell$0$A-WALL; doors from none",)


def test_blocks_that_are_not_in_the_file_are_named(tmp_path):
    sheet = house()
    sheet.space.add_blockref("NOWHERE", (0, 0), dxfattribs=WALL)
    assert "1 block is put in but not in the file: NOWHERE" in read(sheet.save(tmp_path)).remarks


def test_blocks_too_deep_within_others_are_counted(tmp_path):
    sheet = house()
    sheet.document.blocks.new("B0").add_line(*ACROSS, dxfattribs=WALL)
    for depth in range(1, 8):
        sheet.document.blocks.new(f"B{depth}").add_blockref(f"B{depth - 1}", (0, 0))
    sheet.space.add_blockref("B7", (0, 0))
    plan = read(sheet.save(tmp_path))
    assert is_open(plan)
    assert "1 block too deep within others left out" in plan.remarks
