"""Inputs made to hurt: too deep, too large, too many, or leading out of where they lie. Every one is tried."""

import pickle

import numpy as np

from tests.fuzz import bombs_drawings, bombs_files, bombs_grids, bombs_plans
from tests.fuzz.bombs_common import DEEP, Bombs, replace_main
from tests.fuzz.sample import ARCHIVE, MANIFEST, Sample
from tests.fuzz.seeds import samples_of

_CHUNK = b"\x00" * 1_000_000


def bomb_named(reader: str, name: str) -> Sample:
    """Return one bomb, without making those that come after it."""
    return next(sample for its, sample in bombs_of(reader) if its == name)


def bombs_of(reader: str) -> Bombs:
    sample = samples_of(reader)[0]

    def with_main(content: bytes) -> Sample:
        return replace_main(sample, content)

    yield "empty", with_main(b"")
    yield "zeros", with_main(_CHUNK)
    yield "noise", with_main(np.random.default_rng(0).bytes(100_000))
    yield "pickle", with_main(pickle.dumps({"occ_grid": 1}))
    yield "one long line", with_main(b"a" * 5_000_000)
    yield (
        "another format",
        with_main(
            samples_of("svg" if reader != "svg" else "dxf")[0].files["flat.svg" if reader != "svg" else "plan.dxf"]
        ),
    )
    yield "utf-16", with_main(sample.files[sample.main].decode("latin-1").encode("utf-16"))
    if sample.main.endswith(("json", "jsonl")):
        yield from _json_bombs(sample)
    if sample.main.endswith(("xml", "svg")):
        yield from _xml_bombs(sample)
    if sample.main.endswith("npz"):
        yield from bombs_grids.npz_bombs(sample)
    yield from _OWN.get(reader, lambda _: iter(()))(sample)


def _json_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    yield "deep lists", replace_main(sample, b"[" * DEEP + b"]" * DEEP)
    yield "deep mappings", replace_main(sample, b'{"a":' * DEEP + b"1" + b"}" * DEEP)
    for number in ("0", "8", "1.5"):
        for deep in ("[" * DEEP + "]" * DEEP, "[" * 900 + "]" * 900, "1" * 4301, "9" * 400, "1e999", "NaN"):
            place = text.rfind(number)
            if place >= 0:
                bomb = text[:place] + deep + text[place + len(number) :]
                yield f"{number} becomes {deep[:8]} x {len(deep)}", replace_main(sample, bomb.encode())
    yield "100,000 commas", replace_main(sample, b"[" + b"0," * 100_000 + b"0]")
    yield "a key ten thousand times", replace_main(sample, b"{" + b'"features":[],' * 10_000 + b'"a":1}')


def _xml_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    head, _, rest = text.partition("?>\n")
    root = rest[1:].split(">", 1)[0].split(" ", 1)[0]
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    for name, inner in (
        ("billion laughs", f'<!ENTITY l0 "ha">{laughs}'),
        ("quadratic", f'<!ENTITY l9 "{"a" * 100_000}">'),
        ("external entity", '<!ENTITY l9 SYSTEM "file:///etc/passwd">'),
        ("external parameter entity", '<!ENTITY % p SYSTEM "http://127.0.0.1:1/x.dtd"> %p; <!ENTITY l9 "a">'),
    ):
        bomb = f"{head}?>\n<!DOCTYPE {root} [{inner}]>{rest.replace('</', '&l9;</', 1)}"
        yield name, replace_main(sample, bomb.encode())
    yield "external dtd", replace_main(sample, f'{head}?>\n<!DOCTYPE {root} SYSTEM "file:///dev/zero">{rest}'.encode())
    for inner in ("g", "space", "building"):
        deep = f"<{inner}>" * DEEP + f"</{inner}>" * DEEP
        yield f"deep {inner}", replace_main(sample, rest.replace("</", f"{deep}</", 1).encode())
    yield (
        "many attributes",
        replace_main(sample, rest.replace(">", " " + " ".join(f'a{k}="1"' for k in range(100_000)) + ">", 1).encode()),
    )
    yield "many elements", replace_main(sample, rest.replace("</", "<a/>" * 310_000 + "</", 1).encode())
    yield "unknown encoding", replace_main(sample, text.replace("UTF-8", "nonsense-8").encode())
    yield "other encoding", replace_main(sample, text.replace("UTF-8", "utf-7").encode())
    yield "wide encoding", replace_main(sample, text.replace("UTF-8", "utf-32").encode())


_OWN = {
    "ros_map_server": bombs_grids.ros_bombs,
    "raster_picture": bombs_grids.pictures_bombs,
    "amrl_vector_maps": bombs_plans.amrl_bombs,
    "mlstruct": bombs_plans.mlstruct_bombs,
    "resplan": bombs_plans.resplan_bombs,
    "valetudo": bombs_grids.valetudo_bombs,
    "malls_geojson": bombs_plans.features_bombs,
    "wrld": bombs_plans.features_bombs,
    "indoor_geojson": bombs_plans.features_bombs,
    "houseexpo": bombs_plans.houseexpo_bombs,
    "luperto": bombs_plans.luperto_bombs,
    "svg": bombs_drawings.svg_bombs,
    "dxf": bombs_drawings.dxf_bombs,
    "ifc": bombs_drawings.ifc_bombs,
    "moving_ai": bombs_grids.moving_ai_bombs,
    "imdf": bombs_plans.imdf_bombs,
    "plan_geojson": bombs_plans.plan_geojson_bombs,
    ARCHIVE: bombs_files.archive_bombs,
    MANIFEST: bombs_files.manifest_bombs,
}
