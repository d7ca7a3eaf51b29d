import unicodedata

import ezdxf
import pytest

from pipeline.floorplans.readers.dxf_layers import (
    LayerTable,
    bare_name,
    is_door_block,
    is_door_name,
    is_wall_name,
    words,
)
from pipeline.floorplans.readers.reader import ReadOptions

NO_OPTIONS = ReadOptions()


def listed(text: str) -> list[str]:
    """The names in ``text``; ~ stands for a blank in a name."""
    return [name.replace("~", " ") for name in text.split()]


WALLS = listed("""
A-WALL A_WALL A-WALL-EXTR I-WALL-EXT walls Walls~New shell|A-WALL shell$0$A-WALL a|b$12$I-WALL WALL1 EXTWALL DRYWALL
IfcWallStandardCase IntWalls WALLEXT Indoor~walls Wand Wände WÄNDE WAENDE Innenwand AUSSENWAND Trennwände Außenwand
Brandwand Mauerwerk mur MURS Mur~porteur A-MUR-EXT cloisons PAREDES pared-2 Muro MUROS pareti Parede A-GLAZ A-GLAZ-CURT
WINDOWS Fenster fenêtre VENTANAS finestra A-WALL-FULL A-WALL-FIRE SUPPORT-WALL 03_ARCH_WALLS_NEW wall200mm S-WALL-CONC
""")
DOORS = listed("""
A-DOOR DOORS Door-90 M_Single-Door SingleDoor A-DOOR-FULL shell|A-DOOR shell$0$DOOR I-DOOR-INT Tür TÜREN Innentür tuer
Haustür PORTE portes PUERTA puertas-int porta PORTAS portafinestra doorway
""")
NEITHER = listed("""
IMPORTANT NOTES-IMPORTANT G-TRANSPORTATION TRANSPORT REPORTED-AREA REPORT SUPPORT PORTAL PORTABLE EXPORTED IMPORTED
A-FINISH-WALLPAPER WALLPAPER E-WALL-SOCKET WALL-SOCKETS Wall~lights WALL-MOUNTED-SIGN WallPaper A-WALL-PATT Wall~hatch
A-ANNO-WALL A-WALL-DIMS A-WALL-IDEN A-WALL-HEAD wall-tags WALL-TEXT WAND-BEMASSUNG Wand-Schraffur WANDERWEG Wandlampe
AUFWAND Leinwand INDOOR OUTDOOR-LIGHTS A-DOOR-IDEN DOOR_NUMBERS Türnummer Tür-Nummer A-FURN MURAL MURAL-ART 0 Defpoints
SWALLOW WALLET MURATURA-X shell$0$IMPORTANT mywalls|A-FURN porte-manteaux PORTRAIT PORTICO AIRPORT A-CEIL-WALL A-AREA
WALL-HUNG-SINK I-WALL-CLOCKS Wall~Cameras WALL_FOOTINGS P-WALL-PIPE DOOR-LOCKS Door~mats WALL-SWITCH-NEW
""")


@pytest.mark.parametrize("name", WALLS)
def test_walls_are_known_by_a_word_of_the_name(name):
    assert is_wall_name(name, NO_OPTIONS)
    assert not is_door_name(name, NO_OPTIONS)


@pytest.mark.parametrize("name", DOORS)
def test_doors_are_known_by_a_word_of_the_name(name):
    assert is_door_name(name, NO_OPTIONS)
    assert not is_wall_name(name, NO_OPTIONS)


@pytest.mark.parametrize("name", NEITHER)
def test_words_within_words_and_what_hangs_on_walls_are_neither(name):
    assert not is_door_name(name, NO_OPTIONS)
    assert not is_wall_name(name, NO_OPTIONS)


def test_a_block_may_be_named_after_parts_of_a_door_but_not_of_its_label():
    names = ("Door stile and rail", "Door-w-hardware", "M_Door-Single", "Door Tag", "DOOR_NUMBER", "IMPORTANT", "Chair")
    assert [is_door_block(name, NO_OPTIONS) for name in names] == [True] * 3 + [False] * 4
    assert is_door_block("T-90", ReadOptions(door_layers=("t*",)))


def test_an_accent_may_be_written_in_two_ways():
    for name in ("Wände", "Innentür", "fenêtre"):
        twice = unicodedata.normalize("NFD", name)
        assert twice != name
        assert is_wall_name(twice, NO_OPTIONS) is is_wall_name(name, NO_OPTIONS)
        assert is_door_name(twice, NO_OPTIONS) is is_door_name(name, NO_OPTIONS)


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("I-WALL_ext 2", ("i", "wall", "ext")),
        ("03ARCHWalls", ("arch", "walls")),
        ("IfcWallStandardCase", ("ifc", "wall", "standard", "case")),
        ("old|new$3$Wände-AUSSEN", ("wände", "aussen")),
        ("...", ()),
        ("", ()),
    ],
)
def test_names_are_parted_into_words(name, parts):
    assert words(name) == parts


def test_a_bound_name_loses_the_name_of_its_drawing():
    names = {"shell|A-WALL": "A-WALL", "a$0$b$1$C": "C", "A$WALL": "A$WALL", "plain": "plain", "US$5": "US$5"}
    assert {name: bare_name(name) for name in names} == names


def test_what_a_person_names_replaces_the_list():
    options = ReadOptions(wall_layers=("E1*",), door_layers=("t?",))
    assert is_wall_name("e1-new", options)
    assert is_wall_name("shell|E1", options)
    assert not is_wall_name("A-WALL", options)
    assert is_door_name("T3", options)
    assert not is_door_name("A-DOOR", options)
    assert not is_door_name("T33", options)


def test_the_table_knows_what_is_off_and_what_is_frozen():
    document = ezdxf.new()
    for name, colour in (("Plain", 3), ("Off", 4), ("Frozen", 5), ("Both", 6), ("NoPlot", 7)):
        document.layers.add(name, color=colour)
    for name in ("Off", "Both"):
        document.layers.get(name).off()
    for name in ("Frozen", "Both"):
        document.layers.get(name).freeze()
    document.layers.get("NoPlot").dxf.plot = 0
    document.layers.get("Plain").lock()
    table = LayerTable.of(document)
    names = ("plain", "OFF", "frozen", "both", "NoPlot", "absent")
    assert [table.is_hidden(name) for name in names] == [False, True, True, True, False, False]
    assert [table.is_frozen(name) for name in names] == [False, False, True, True, False, False]
