"""Small pieces of HTML. Everything that comes from data passes through ``escape`` here and nowhere else."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path


def heading(text: str) -> str:
    """Return the title of the page."""
    return f"<h1>{escape(text)}</h1>"


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of plain ``text``."""
    return f"<p{_class(kind)}>{escape(text)}</p>"


def section(title: str, *parts: str, name: str) -> str:
    """Return a titled section of ready HTML ``parts`` that links can reach as ``#name``; empty without parts."""
    inner = "\n".join(part for part in parts if part)
    return f'<section id="{escape(name)}">\n<h2>{escape(title)}</h2>\n{inner}\n</section>' if inner else ""


def picture(path: Path, title: str, caption: str, kind: str = "") -> str:
    """Return the PNG at ``path`` inside the page, with title and caption of plain text."""
    data = b64encode(path.read_bytes()).decode("ascii")
    return (
        f'<figure{_class(kind)}>\n<h3>{escape(title)}</h3>\n<div class="pan"><img alt="{escape(title)}" '
        f'src="data:image/png;base64,{data}"></div>\n<figcaption>{escape(caption)}</figcaption>\n</figure>'
    )


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, marked: Sequence[str] = ()) -> str:
    """Return a table of plain text that scrolls sideways on a narrow screen.

    marked: a class for each row, in order; rows beyond it have none.
    """
    kinds = [*marked]
    lines = []
    for index, row in enumerate(rows):
        first, *rest = row
        cells = f'<th scope="row">{escape(first)}</th>' + "".join(f"<td>{escape(cell)}</td>" for cell in rest)
        lines.append(f"<tr{_class(kinds[index] if index < len(kinds) else '')}>{cells}</tr>")
    top = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "\n".join(lines)
    return f'<div class="wide"><table>\n<thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>'


def pairs(entries: Iterable[tuple[str, str]]) -> str:
    """Return names and values as a list of definitions."""
    items = "\n".join(f"<div><dt>{escape(name)}</dt><dd>{escape(value)}</dd></div>" for name, value in entries)
    return f'<dl class="pairs">\n{items}\n</dl>' if items else ""


def tiles(entries: Iterable[tuple[str, str, str]]) -> str:
    """Return headline numbers: value, name, and a line beneath."""
    items = "\n".join(
        f"<li><strong>{escape(value)}</strong><span>{escape(name)}</span><small>{escape(beneath)}</small></li>"
        for value, name, beneath in entries
    )
    return f'<ul class="tiles">\n{items}\n</ul>'


def notice(sentences: Iterable[str]) -> str:
    """Return sentences that a reader must not miss; empty without any."""
    items = "\n".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    return f'<ul class="notice">\n{items}\n</ul>' if items else ""


def folded(title: str, *parts: str) -> str:
    """Return ready HTML ``parts`` that open on a click."""
    return f"<details>\n<summary>{escape(title)}</summary>\n{''.join(parts)}\n</details>"


def document(title: str, style: str, *parts: str) -> str:
    """Return a whole page that loads nothing from anywhere."""
    inner = "\n".join(part for part in parts if part)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n{inner}\n</main>\n</body>\n"
        "</html>\n"
    )


def _class(kind: str) -> str:
    return f' class="{escape(kind)}"' if kind else ""
