"""Which layers of a DXF drawing hold walls and doors, by the words of their names, and which are switched off.

A name is taken apart into words: ``I-WALL-EXT`` and ``shell$0$Walls_New`` hold the word wall, ``IMPORTANT`` no door
and ``WALLPAPER`` no wall. A word that says what hangs on a wall or what is written about it (``E-WALL-SOCKET``,
``A-WALL-PATT``) takes the layer out. English and German put words together at their end: ``DRYWALL``, ``Innenwände``.
"""

import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from pipeline.floorplans.readers.drawing import PARSER_ERRORS, is_any_of
from pipeline.floorplans.readers.reader import ReadOptions

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

_SIDES = "(?:ext|int|exterior|interior|inner|outer|new|old|exist|existing|innen|aussen|neu|bestand|tragend)"
_WALLS = re.compile(
    rf".*walls?|walls?{_SIDES}|.*(?:wand|wände|waende|wande|mauer|mauern)|(?:wand|wände|waende){_SIDES}|mauerwerk"
    r"|murs?|cloisons?|pared|paredes|parede|muros?|muri|parete|pareti"
)
_WINDOWS = re.compile(r".*windows?|glaz\w*|.*fensters?|fen[eê]tres?|ventanas?|finestr[ae]|janelas?")
_DOORS = re.compile(
    rf".*doors?|doors?{_SIDES}|doorways?|.*(?:tuer|tueren|tür|türen)|(?:tür|tuer){_SIDES}"
    r"|portes?|puertas?|portas?|portafinestra|portefinestre"
)
_NOT_THESE = re.compile(r"(?:in|out)doors?|(?:auf|ein|ge|lein)wand")
# What is written about a wall or a door, or drawn over it: patterns, dimensions, tags, what only a ceiling plan shows.
_WRITTEN = (
    "patt pattern patterns hatch hatches hatching fill fills anno annotation annotations dim dims dimension "
    "dimensions text texts txt ceil ceiling clng iden ident tag tags note notes label labels legend number numbers "
    "schedule schedules symbol symbols head headers elev elevation elevations area areas schraffur schraffuren "
    "bemassung beschriftung nummer nummern texte hachure hachures cotes cotation sombreado"
)
# What hangs on a wall, covers it or belongs to a door.
_MOUNTED = (
    "socket sockets outlet outlets switch switches light lights lighting lamp lamps luminaire luminaires sconce "
    "sconces fixture fixtures cabinet cabinets cupboard cupboards shelf shelves paper papers wallpaper tile tiles "
    "tiling finish finishes finishing paint painting paintings art picture pictures sign signs signage clock clocks "
    "mount mounted bracket brackets rail rails handrail handrails grille grilles radiator radiators heater heaters "
    "register registers diffuser diffusers plug plugs hardware bell bells decor decoration mirror mirrors "
    "steckdose steckdosen leuchte leuchten lampe lampen schalter schrank schränke regal regale fliese "
    "fliesen tapete prise prises applique appliques manteau manteaux serviette serviettes lampara lamparas hung tv "
    "speaker speakers camera cameras sensor sensors sink sinks basin basins urinal urinals toilet toilets "
    "extinguisher extinguishers hydrant hydrants alarm alarms vent vents duct ducts pipe pipes cable cables "
    "thermostat thermostats trim skirting footing footings handle handles knob knobs lock locks closer closers mat "
    "mats"
)
_LABELS = frozenset(_WRITTEN.split())
_NEITHER = _LABELS | frozenset(_MOUNTED.split())
_CAMEL = re.compile(r"(?<=[^\W\d_A-ZÄÖÜ])(?=[A-ZÄÖÜ])|(?<=[A-ZÄÖÜ])(?=[A-ZÄÖÜ][^\W\d_A-ZÄÖÜ])")
_XREF = re.compile(r".*(?:\||\$\d+\$)", re.DOTALL)
_MOST_LETTERS = 255  # of a layer's name in the format
_FROZEN = 1

EXAMPLES_OF_WALLS = "wall, Wand, mur, pared, muro"


def bare_name(name: str) -> str:
    """Return ``name`` without the drawing it was bound from: ``A-WALL`` of ``shell|A-WALL`` and ``shell$0$A-WALL``."""
    return _XREF.sub("", name[:_MOST_LETTERS])


@lru_cache(maxsize=10_000)
def words(name: str) -> tuple[str, ...]:
    """Return the words of a name in small letters, parted at signs, digits and capitals within a word."""
    plain = unicodedata.normalize("NFC", bare_name(name))
    return tuple(word.casefold() for part in re.findall(r"[^\W\d_]+", plain) for word in _CAMEL.split(part) if word)


def _holds(name: str, kinds: Iterable[re.Pattern[str]], unless: frozenset[str] = _NEITHER) -> bool:
    parts = words(name)
    if any(word in unless for word in parts):
        return False
    return any(kind.fullmatch(word) and not _NOT_THESE.fullmatch(word) for word in parts for kind in kinds)


def is_door_name(name: str, options: ReadOptions) -> bool:
    """Return whether a layer of this name holds doors; names that a person gave replace the list."""
    if options.door_layers:
        return is_named(name, options.door_layers)
    return _holds(name, (_DOORS,))


def is_door_block(name: str, options: ReadOptions) -> bool:
    """Return whether a block of this name is a door; it may be named after its parts, as ``Door stile and rail``."""
    if options.door_layers:
        return is_named(name, options.door_layers)
    return _holds(name, (_DOORS,), _LABELS)


def is_wall_name(name: str, options: ReadOptions) -> bool:
    """Return whether a layer of this name holds walls or windows; names that a person gave replace the list."""
    if options.wall_layers:
        return is_named(name, options.wall_layers)
    return _holds(name, (_WALLS, _WINDOWS))


def is_named(name: str, patterns: tuple[str, ...]) -> bool:
    """Return whether a name, with or without the drawing it was bound from, fits a pattern of a person."""
    return is_any_of(name, patterns) or is_any_of(bare_name(name), patterns)


class Hidden(NamedTuple):
    """How a layer is switched off. A frozen block reference hides all it holds; an off one what takes its layer."""

    off: bool
    frozen: bool


@dataclass(frozen=True)
class LayerTable:
    """What the table of layers says of visibility; names of layers know no case, and may be absent from it."""

    hidden: dict[str, Hidden]

    @classmethod
    def of(cls, document: "Document") -> "LayerTable":
        """Return the table of ``document``; damaged entries count as visible."""
        return cls({name.casefold(): state for name, state in _states(document) if state.off or state.frozen})

    def is_hidden(self, name: str) -> bool:
        """Return whether what lies on the layer ``name`` is not drawn."""
        return name.casefold() in self.hidden

    def is_frozen(self, name: str) -> bool:
        """Return whether the layer ``name`` is frozen."""
        state = self.hidden.get(name.casefold())
        return state is not None and state.frozen


def _states(document: "Document") -> Iterator[tuple[str, Hidden]]:
    for layer in document.layers:
        try:
            yield str(layer.dxf.name), _state(layer)
        except PARSER_ERRORS:
            continue


def _state(layer: Any) -> Hidden:
    return Hidden(off=int(layer.dxf.get("color", 7)) < 0, frozen=bool(int(layer.dxf.get("flags", 0)) & _FROZEN))
