# SPDX-License-Identifier: Apache-2.0
"""`mfba import`: make scenario files of worlds and recordings in other formats; needs no ROS."""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields
from pathlib import Path

from ..core.argument_parser import Parser
from ..core.errors import MfbaError, OutputError
from ..core.output_files import new_run_directory, write_new
from ..scenarios.importers.import_files import FORMATS, files_in, import_files
from ..scenarios.importers.imported import ImportOptions

_DESCRIPTION = """Make scenario files (YAML) of worlds and recordings in other formats.

What cannot be said in a scenario is lost, and named in one line. A file that cannot be read is
named; the others are imported. `mfba sweep DIR` runs planners in the result.
"""


def main(args: list[str]) -> int:
    """Import; 0 when every file was accepted."""
    parsed = _parser().parse(args)
    options = _options(parsed)
    paths = files_in(parsed.files)
    out = parsed.out or new_run_directory(stem="import")
    if out.exists() and not (out.is_dir() and not any(out.iterdir())):
        raise OutputError(f"{out}: exists and is not empty; choose another --out")
    written = refused = 0
    lost: dict[str, list[Path]] = {}
    for result in import_files(paths, options, parsed.format):
        if result.error:
            refused += 1
            print(f"refused: {result.error}", file=sys.stderr, flush=True)
        for line in result.lost:
            lost.setdefault(line, []).append(result.path)
        for name, text in result.texts.items():
            _make(out)
            write_new(out / f"{name}.yaml", text.encode())
            written += 1
    for line, files in lost.items():
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        print(f"{files[0]}{more}: lost: {line}")
    if not written:
        raise MfbaError(f"none of {len(paths)} files was imported, see above; nothing is written")
    print(f"wrote {out}: {written} scenarios of {len(paths) - refused} files")
    if refused:
        raise MfbaError(f"{refused} of {len(paths)} files refused, see above; mend or leave out")
    return 0


def _make(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise OutputError(
            f"{directory}: cannot be made ({reason}); give a writable --out"
        ) from None


def _parser() -> Parser:
    formats = [
        f"  {name:<9} {', '.join(endings):<15} {what}"
        for name, (endings, what, _) in FORMATS.items()
    ]
    parser = Parser(
        prog="mfba import",
        description=_DESCRIPTION,
        epilog="formats, by the ending of a file (also with .gz):\n" + "\n".join(formats),
    )
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE | DIR", help="files, or directories of them"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory to create for the scenario files (default: a new one below runs/)",
    )  # fmt: skip
    parser.add_argument(
        "--format", metavar="NAME", help=f"one of {', '.join(FORMATS)} (default: by the ending)"
    )
    for name in ("start", "goal"):
        parser.add_argument(
            f"--{name}", nargs=2, type=float, metavar=("X", "Y"),
            help=f"{name} of the robot, m (default: that of the file or of its format)",
        )  # fmt: skip
    for name, what in (
        ("--robot-radius", "radius of the robot, m"),
        ("--time-limit", "time limit of a run, s"),
    ):
        parser.add_argument(
            name, type=float, metavar="VALUE", help=f"{what} (default: as of the format)"
        )
    for item in fields(ImportOptions):
        if spec := item.metadata.get("spec"):
            unit = f", {spec.unit}" if spec.unit else ""
            parser.add_argument(
                _argument(item.name), type=type(item.default), default=item.default,
                dest=item.name, metavar="VALUE",
                help=f"{spec.doc}{unit} (default: {item.default:g})",
            )  # fmt: skip
    return parser


def _argument(name: str) -> str:
    return "--" + name.removesuffix("_m").removesuffix("_s").removesuffix("_mps").replace("_", "-")


def _options(parsed: argparse.Namespace) -> ImportOptions:
    given = {item.name: getattr(parsed, item.name) for item in fields(ImportOptions)
             if item.metadata.get("spec")}  # fmt: skip
    return ImportOptions(
        start_m=tuple(parsed.start) if parsed.start else None,
        goal_m=tuple(parsed.goal) if parsed.goal else None,
        robot_radius_m=parsed.robot_radius,
        time_limit_s=parsed.time_limit,
        **given,
    )
