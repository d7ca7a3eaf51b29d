"""The command ``hinterland plan``: look at floor plans, convert them, and see many of them at once.

Nothing but the parser is imported until a command is known, so that ``--help`` answers at once.
"""

import os
import sys
from argparse import ArgumentParser, Namespace, RawDescriptionHelpFormatter
from collections.abc import Callable, Sequence
from importlib import import_module

from pipeline.errors import HinterlandError
from pipeline.stages.plan_options import add_read_options, add_workers, in_flags, number_from, whole_number

_EXAMPLES = """examples:
  hinterland plan info floor.dxf                         what is in it, and what is odd about it
  hinterland plan info scan.png --scale 0.05 --draw scan_seen.png
  hinterland plan convert floor.dxf floor.yaml           a map for ROS, cells of 5 cm
  hinterland plan convert venue.geojson floors --to plan_geojson
  hinterland plan sheet /data/buildings all.png          every plan below a folder, small, on one picture
  hinterland plan survey /data --options scales.yaml     a table: what was read, what was not and why
  hinterland plan formats                                what can be read and written

FILE may be a folder, a file or an archive (zip, gz). HINTERLAND_TRACEBACK=1 shows where an error came from.
"""


def main(arguments: Sequence[str]) -> int:
    """Run ``hinterland plan`` with these arguments; return 0, or 1 with one line on stderr for what was refused."""
    parser = build_parser()
    given = parser.parse_args(list(arguments))
    try:
        module, name = given.body
        body: Callable[[Namespace], int] = getattr(import_module(module), name)
        code = body(given)
        sys.stdout.flush()
    except HinterlandError as error:
        if os.environ.get("HINTERLAND_TRACEBACK"):
            raise
        print(f"error: {in_flags(str(error))}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:  # `| head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return code


def build_parser() -> ArgumentParser:
    """Return the parser of all commands; what it parses holds in ``body`` the module and function to call."""
    parser = ArgumentParser(
        prog="hinterland plan",
        description="Look at floor plans, convert them, and see many of them at once.",
        epilog=_EXAMPLES,
        formatter_class=RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, module: str, text: str, more: str = "") -> ArgumentParser:
        sub = commands.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}. {more}".strip())
        sub.set_defaults(body=(f"pipeline.stages.{module}", name))
        return sub

    _add_info(command("info", "plan_info", "print what is in each plan, and draw it"))
    more = "Nothing is written unless all of it can be; geometry is rasterised for formats of cells."
    _add_convert(command("convert", "plan_convert", "write plans in another format", more))
    _add_sheet(command("sheet", "plan_sheet", "draw all plans below a folder on one picture, each with its scale"))
    more = "A data set is a folder in FOLDER, or an archive beside it; plans in FOLDER itself make one."
    _add_survey(command("survey", "plan_survey", "print a table of what each data set below a folder holds", more))
    more = "A floor is one with marked rooms. Columns: generated campus floors, then each FOLDER."
    _add_statistics(command("statistics", "plan_statistics", "compare rooms, doors and corridors of floors", more))
    command("formats", "plan_formats", "list the formats that are read and written")
    return parser


def _add_info(parser: ArgumentParser) -> None:
    parser.add_argument("source", metavar="FILE", help="a file, a folder or an archive")
    parser.add_argument("--draw", metavar="PNG|DIR", help="draw the plan to a PNG; several plans, into a folder")
    parser.add_argument("--json", action="store_true", help="print a JSON array instead of text")
    _add_force(parser)
    add_read_options(parser)


def _add_convert(parser: ArgumentParser) -> None:
    parser.add_argument("source", metavar="FILE", help="a file, a folder or an archive")
    parser.add_argument("out", metavar="OUT", help="the file to write; for several plans, a folder")
    parser.add_argument("--to", metavar="FORMAT", help="format to write; by default that of the ending of OUT")
    text = "side of a cell [m]; geometry becomes cells (0.05 where the format has only those), cells become coarser"
    parser.add_argument("--resolution", metavar="M", type=number_from(0.001, 10, " m"), help=text)
    parser.add_argument("--skip-bad", action="store_true", help="leave out plans that cannot be used, naming them")
    _add_force(parser)
    add_read_options(parser)


def _add_sheet(parser: ArgumentParser) -> None:
    parser.add_argument("source", metavar="FOLDER", help="a folder, a file or an archive")
    parser.add_argument("out", metavar="OUT.png", help="the picture to write; with --data-sets, a folder")
    parser.add_argument("--limit", type=whole_number, metavar="N", help="only the first N plans, by the names of files")
    parser.add_argument("--data-sets", action="store_true", help="one picture for each folder or archive in FOLDER")
    parser.add_argument("--options", metavar="YAML", help="with --data-sets: how each is to be read; see survey --help")
    _add_force(parser)
    add_workers(parser)
    add_read_options(parser)


def _add_survey(parser: ArgumentParser) -> None:
    parser.add_argument("source", metavar="FOLDER", help="a folder of data sets, or one of them")
    parser.add_argument(
        "--options",
        metavar="YAML",
        help="how data sets are to be read, by name, with the keys of conf/plans/ (read) and reader: "
        "{homes: {metres_per_unit: 0.05, invert: true}}",
    )
    text = "also say how much floor a robot can no longer reach on cells of M metres; grids: the nearest multiple"
    parser.add_argument("--resolution", metavar="M", type=number_from(0.01, 1, " m"), help=text)
    text = "of the robot, with --resolution (0.15)"
    parser.add_argument("--robot-radius", metavar="M", type=number_from(0.01, 2, " m"), default=0.15, help=text)
    add_workers(parser)


def _add_statistics(parser: ArgumentParser) -> None:
    parser.add_argument("sources", metavar="FOLDER", nargs="*", help="real floors; each variant of a floor counts once")
    parser.add_argument(
        "--floors", type=whole_number, default=40, metavar="N", help="at most so many for a column (40)"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="of the generated floors (0)")


def _add_force(parser: ArgumentParser) -> None:
    parser.add_argument("--force", action="store_true", help="overwrite what is there")
