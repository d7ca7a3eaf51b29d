"""What a drawing says of the look of its shapes: attributes, style sheets and ``style``, in the order of CSS.

tinycss2 and cssselect2 read the sheets and test single elements. How selectors combine (descendant, child, sibling) is
followed here in one walk over the tree: the library tries every way to find the ancestors, which takes
hundreds of years in a sheet made for it.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

from pipeline.errors import PlanError

# Inherited by what is drawn inside; the others are of one element.
INHERITED = frozenset(
    ("fill", "fill-opacity", "fill-rule", "clip-rule", "color", "visibility", "stroke", "stroke-opacity")
) | frozenset(("stroke-width", "stroke-linecap", "stroke-linejoin", "stroke-miterlimit"))
_OF_ONE = frozenset(("display", "opacity", "transform", "transform-origin", "transform-box", "clip-path", "mask")) | (
    frozenset(("vector-effect", "overflow", "x", "y", "width", "height", "rx", "ry", "r", "cx", "cy"))
)
_PROPERTIES = INHERITED | _OF_ONE
_STYLE_ONLY = frozenset(("translate", "rotate", "scale"))  # attributes of these names mean something else
_MOST_TOKENS = 400  # of a selector
_MOST_TESTS = 2_500_000
_LETTERS_AS_TEST = 20
_VARIABLE = re.compile(r"var\(\s*+(--[\w-]++)\s*+(?:,((?:[^()]|\([^()]*+\))*+))?\)")
_MOST_VARIABLES, _LONGEST_VALUE = 20, 2000
_FEW_ELEMENTS = 5000

_Said = tuple[dict[str, str], dict[str, str]]  # declared values, and those that are !important


class _Step(NamedTuple):
    """One compound of a selector. needs: the step before it, which ``combinator`` says where to find."""

    number: int
    test: Any
    combinator: str
    needs: int
    ends: int  # the selector that it completes, or -1
    texts: tuple[str, ...]  # the attributes whose whole text it looks through


class _Around(NamedTuple):
    """The steps that elements around one have met."""

    parent: frozenset[int] = frozenset()
    above: frozenset[int] = frozenset()
    previous: frozenset[int] = frozenset()
    before: frozenset[int] = frozenset()


class Styles:
    """The declared values of every element. unread: how many rules and sheets could not be read."""

    def __init__(self, root: Element, name: str) -> None:
        self.unread = 0
        self._by_rules: dict[Element, list[int]] = {}
        self._sheet = _Sheet(sum(1 for _ in root.iter()))
        for text in _sheets(root):
            self._sheet.add(text)
        self.unread = self._sheet.unread
        if self._sheet.said:
            self._by_rules = _matched(root, self._sheet, name)

    def of(self, element: Element) -> dict[str, str]:
        """Return the declared values of the properties that matter here, which ``inherited`` ones leave out."""
        values = {key: element.attrib[key] for key in _PROPERTIES.intersection(element.attrib)}
        rules = [self._sheet.said[number] for number in self._by_rules.get(element, ())]
        own: _Said = _declarations(element.get("style", "")) if "style" in element.attrib else ({}, {})
        for said, _ in (*rules, own):
            values |= said
        for _, important in (*rules, own):
            values |= important
        return values


class _Sheet:
    """The rules of all style sheets. said: what selector number k declares. steps: by what an element must have."""

    def __init__(self, elements: int) -> None:
        self.said: list[_Said] = []
        self.specificity: list[tuple[int, int, int]] = []
        self.steps: dict[tuple[str, str], list[_Step]] = {}
        self.unread = 0
        self._count = 0
        self._few = elements <= _FEW_ELEMENTS

    def add(self, text: str) -> None:
        """Read one sheet."""
        import tinycss2

        pending = [tinycss2.parse_stylesheet(_shortened(text), skip_comments=True, skip_whitespace=True)]
        while pending:
            for rule in pending.pop():
                if rule.type == "qualified-rule":
                    self._add_rule(rule)
                elif rule.type == "at-rule" and rule.lower_at_keyword in ("media", "supports", "layer"):
                    query = tinycss2.serialize(rule.prelude).strip().lower()
                    shown = query in ("", "all", "screen", "only screen") or rule.lower_at_keyword == "layer"
                    if shown and rule.content is not None:
                        pending.append(tinycss2.parse_rule_list(rule.content, skip_comments=True, skip_whitespace=True))
                    elif query != "print":
                        self.unread += 1
                elif rule.type == "error" or rule.lower_at_keyword == "import":
                    self.unread += 1

    def _add_rule(self, rule: Any) -> None:
        """Take up a rule, unless it says nothing that matters; count it where it cannot be followed."""
        import tinycss2
        from cssselect2 import SelectorError
        from cssselect2.parser import parse

        said, nested = _declared(tinycss2.parse_blocks_contents(rule.content))
        self.unread += nested
        if not said[0] and not said[1]:
            return
        try:
            selectors = list(parse(rule.prelude)) if len(rule.prelude) <= _MOST_TOKENS else []
            chains = [_chain(selector, few=self._few) for selector in selectors if selector.pseudo_element is None]
        except (SelectorError, ValueError, NotImplementedError, RecursionError):
            selectors, chains = [], []
        if not selectors:
            self.unread += 1
        for chain, specificity in chains:
            self._add_chain(chain)
            self.said.append(said)
            self.specificity.append(specificity)

    def _add_chain(self, chain: list[tuple[str, Any, Any]]) -> None:
        from cssselect2.parser import AttributeSelector

        for position, (combinator, compound, test) in enumerate(chain):
            ends = len(self.said) if position == len(chain) - 1 else -1
            texts = tuple(part.name for part in compound.simple_selectors if isinstance(part, AttributeSelector))
            step = _Step(self._count, test, combinator, self._count - 1 if position else -1, ends, texts)
            self.steps.setdefault(_key(compound), []).append(step)
            self._count += 1


def _sheets(root: Element) -> Iterator[str]:
    for element in root.iter():
        if isinstance(element.tag, str) and element.tag.rpartition("}")[2] == "style":
            shown = element.get("media", "").strip().lower() in ("", "all", "screen")
            if shown and element.get("type", "text/css").strip().lower() in ("", "text/css"):
                yield "".join(element.itertext())


def _chain(selector: Any, *, few: bool) -> tuple[list[tuple[str, Any, Any]], tuple[int, int, int]]:
    """Return the compounds of a selector from left to right, each with the combinator before it and its test.

    Raises:
        ValueError: it has what cannot be tested in time.
    """
    from cssselect2.compiler import CompiledSelector
    from cssselect2.parser import CombinedSelector, Selector

    parts, node = [], selector.parsed_tree
    while isinstance(node, CombinedSelector):
        parts.append((node.combinator, node.right))
        node = node.left
    parts.append(("", node))
    for _, compound in parts:
        _check(compound, few=few)
    chain = [(combinator, each, CompiledSelector(Selector(each)).test) for combinator, each in reversed(parts)]
    return chain, selector.specificity


def _check(compound: Any, *, few: bool, inner: bool = False) -> None:
    from cssselect2 import parser

    logical = (parser.NegationSelector, parser.MatchesAnySelector, parser.SpecificityAdjustmentSelector)
    plain = (parser.LocalNameSelector, parser.NamespaceSelector, parser.ClassSelector, parser.IDSelector)
    for part in compound.simple_selectors:
        if isinstance(part, logical) and not inner:
            for selector in part.selector_list:
                if not isinstance(selector.parsed_tree, parser.CompoundSelector):
                    raise ValueError("a combination in brackets")
                _check(selector.parsed_tree, few=few, inner=True)
        elif isinstance(part, parser.FunctionalPseudoClassSelector):
            counts = part.name in ("nth-child", "nth-last-child") or (few and part.name.endswith("of-type"))
            if not counts or any(token.type == "ident" and token.value == "of" for token in part.arguments):
                raise ValueError("a function that takes long")
        elif isinstance(part, parser.PseudoClassSelector):
            if part.name.endswith("of-type") and not few:
                raise ValueError("a count that takes long")
        elif not isinstance(part, (*plain, parser.AttributeSelector)):
            raise ValueError("a selector that takes long")


def _key(compound: Any) -> tuple[str, str]:
    """Return something that an element must have to pass a compound: an id, a class, a name, or nothing."""
    from cssselect2 import parser

    for part in compound.simple_selectors:
        if isinstance(part, parser.IDSelector):
            return "id", part.ident
    for part in compound.simple_selectors:
        if isinstance(part, parser.ClassSelector):
            return "class", part.class_name
    for part in compound.simple_selectors:
        if isinstance(part, parser.LocalNameSelector):
            return "name", part.local_name
    return "", ""


def _matched(root: Element, sheet: _Sheet, name: str) -> dict[Element, list[int]]:
    """Return the selectors that match each element, the strongest last."""
    from cssselect2 import ElementWrapper

    found: dict[Element, list[int]] = {}
    tests = 0

    def met(wrapper: Any, around: _Around) -> frozenset[int]:
        """Return the steps that an element meets, and keep the selectors that these complete."""
        nonlocal tests
        keys = [("", ""), ("name", wrapper.local_name), ("id", wrapper.id)]
        keys += [("class", each) for each in wrapper.classes]
        passed = []
        where = {" ": around.above, ">": around.parent, "+": around.previous, "~": around.before}
        for step in [step for key in keys for step in sheet.steps.get(key, ())]:
            tests += 1 + sum(len(wrapper.etree_element.get(key, "")) for key in step.texts) // _LETTERS_AS_TEST
            if tests > _MOST_TESTS:
                raise PlanError(f"{name}: its style sheets take more than {_MOST_TESTS:,} tests. Simplify them.")
            if (step.needs < 0 or step.needs in where[step.combinator]) and step.test(wrapper):
                passed.append(step)
        ended = [step.ends for step in passed if step.ends >= 0]
        if ended:
            found[wrapper.etree_element] = sorted(ended, key=lambda number: (sheet.specificity[number], number))
        return frozenset(step.number for step in passed if step.ends < 0)

    top = ElementWrapper.from_xml_root(root)
    stack = [(top, met(top, _Around()), frozenset[int]())]
    while stack:
        wrapper, parent, above = stack.pop()
        above = above | parent if parent else above
        around = _Around(parent, above)
        for child in wrapper.iter_children():
            own = met(child, around)
            around = _Around(parent, above, own, around.before | own if own else around.before)
            tests += len(above) + len(around.before) if own else 0
            stack.append((child, own, above))
    return found


@lru_cache(maxsize=4096)
def _declarations(text: str) -> _Said:
    import tinycss2

    return _declared(tinycss2.parse_blocks_contents(_shortened(text)))[0]


def _shortened(text: str) -> str:
    """Cut numbers that Python reads no integer from: past 400 digits they are infinite, or their end counts nothing."""
    return re.sub(r"(\d{400})\d+", r"\1", text)


def _declared(tokens: Sequence[Any]) -> tuple[_Said, int]:
    """Return what a block declares of the properties that matter, and how many rules stand in it."""
    import tinycss2

    said: _Said = ({}, {})
    for token in tokens:
        if token.type != "declaration":
            continue
        if token.lower_name in _PROPERTIES | _STYLE_ONLY or token.name.startswith("--"):
            try:
                value = tinycss2.serialize(token.value).strip()
            except RecursionError:  # brackets in brackets
                value = ""
            if value:
                said[token.important][token.name if token.name.startswith("--") else token.lower_name] = value
    return said, sum(token.type == "qualified-rule" for token in tokens)


def resolved(said: dict[str, str], handed: Mapping[str, str]) -> dict[str, str]:
    """Return declared values with each ``var(--name, otherwise)`` replaced; ``handed``: what the parent hands on.

    As in CSS, a value that names a variable which is not set counts as not declared.
    """
    if not any("var(" in value for value in said.values()):
        return said
    known = {**handed, **said}
    values = ((key, _resolved(value, known)) for key, value in said.items())
    return {key: value for key, value in values if value is not None}


def _resolved(value: str, known: Mapping[str, str]) -> str | None:
    for _ in range(_MOST_VARIABLES):
        if len(value) > _LONGEST_VALUE:
            return None
        match = _VARIABLE.search(value)
        if match is None:
            return value if "var(" not in value else None
        name, otherwise = match.groups()
        put = known.get(name, otherwise)
        if put is None:
            return None
        value = f"{value[: match.start()]}{put.strip()}{value[match.end() :]}"
    return None  # variables in a circle


def inherited(outer: Mapping[str, str], said: Mapping[str, str]) -> Mapping[str, str]:
    """Return what an element hands on: what it says of the properties that are inherited, else what it was handed."""
    hands_on = [key for key in said if key in INHERITED or key.startswith("--")]
    own = {key: said[key] for key in hands_on if said[key].lower() not in ("inherit", "unset")}
    if not own:
        return outer
    return {key: value for key, value in {**outer, **own}.items() if value.lower() not in ("initial", "revert")}
