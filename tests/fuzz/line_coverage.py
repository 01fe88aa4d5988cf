#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints a line of scripts/fuzz --coverage: of the functions that a reader enters, the share of lines
that its inputs reached, and where the most of the others lie.

usage: llvm-cov export -format=text … | line_coverage.py READER SOURCE_FOLDER
"""

import json
import os
import sys
from collections import defaultdict

SHOWN = ("lib/", "pipelines/")
HIDDEN = "lib/core/"  # serves them all


def lines_of(function):
    """line → whether it was reached, of one function: the innermost region on a line decides."""
    reached = {}
    for region in sorted(function["regions"], key=lambda r: (r[0], -r[2])):
        first, _, last, _, count, file, _, kind = region
        if kind != 0 or file != 0:  # code of the function's own file, no macro, gap or branch
            continue
        for line in range(first, last + 1):
            reached[line] = count > 0
    return reached


def main():
    reader, source = sys.argv[1], sys.argv[2].rstrip("/") + "/"
    files = defaultdict(dict)  # file → line → reached
    for function in json.load(sys.stdin)["data"][0]["functions"]:
        name = os.path.normpath(function["filenames"][0]).removeprefix(source)
        if not function["count"] or not name.startswith(SHOWN) or name.startswith(HIDDEN):
            continue
        for line, hit in lines_of(function).items():
            files[name][line] = files[name].get(line, False) or hit
    total = sum(len(lines) for lines in files.values())
    missed = {name: sorted(line for line, hit in lines.items() if not hit)
              for name, lines in files.items()}
    count = sum(len(lines) for lines in missed.values())
    share = 100 * (total - count) / total if total else 0
    worst = sorted(missed.items(), key=lambda item: -len(item[1]))[:3]
    told = ", ".join(f"{name}: {len(lines)} from {lines[0]} on" for name, lines in worst if lines)
    print(f"{reader}: {share:.1f} % of {total} lines; not reached: {told or 'none'}")


main()
