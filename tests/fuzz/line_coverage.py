#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts/fuzz --coverage prints: of the functions that a reader enters, the share of lines that
its inputs reached. Then of all readers together: what one enters another may reach.

usage: llvm-cov export -format=text … | line_coverage.py READER SOURCE_FOLDER RECORD
       line_coverage.py --together RECORD…
  RECORD  a file that the first writes and the second reads: file → line → whether it was reached
"""

import json
import os
import sys
from collections import defaultdict

SHOWN = ("lib/", "pipelines/")
HIDDEN = "lib/core/"  # serves them all
ENOUGH = 90  # per cent


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


def entered_lines(exported, source):
    files = defaultdict(dict)
    for function in exported["data"][0]["functions"]:
        name = os.path.normpath(function["filenames"][0]).removeprefix(source)
        if not function["count"] or not name.startswith(SHOWN) or name.startswith(HIDDEN):
            continue
        for line, hit in lines_of(function).items():
            files[name][str(line)] = files[name].get(str(line), False) or hit
    return files


def share(files):
    hits = [hit for lines in files.values() for hit in lines.values()]
    return 100 * sum(hits) / len(hits) if hits else 0


def missed(files):
    """file → the lines that were not reached, most first."""
    lines = {name: sorted(int(line) for line, hit in reached.items() if not hit)
             for name, reached in files.items()}
    return sorted(((name, at) for name, at in lines.items() if at), key=lambda item: -len(item[1]))


def ranges(lines):
    """ "12, 40-43" """
    runs = []
    for line in lines:
        if runs and line == runs[-1][1] + 1:
            runs[-1][1] = line
        else:
            runs.append([line, line])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in runs)


def tell_one(reader, source, record):
    files = entered_lines(json.load(sys.stdin), source.rstrip("/") + "/")
    with open(record, "w") as out:
        json.dump(files, out)
    told = ", ".join(f"{name}: {len(at)} from {at[0]} on" for name, at in missed(files)[:3])
    count = sum(len(lines) for lines in files.values())
    print(f"{reader}: {share(files):.1f} % of {count} lines; not reached: {told or 'none'}")


def tell_all(records):
    readers = []
    for record in records:
        with open(record) as file:
            readers.append(json.load(file))
    together = defaultdict(dict)
    for files in readers:
        for name, lines in files.items():
            for line, hit in lines.items():
                together[name][line] = together[name].get(line, False) or hit
    alone = sum(share(files) >= ENOUGH for files in readers)
    helped = sum(share({name: {line: together[name][line] for line in lines}
                        for name, lines in files.items()}) >= ENOUGH for files in readers)
    print(f"{alone} of {len(readers)} readers reach {ENOUGH} % of the lines that they enter; "
          f"with what the others reach of these, {helped}")
    count = sum(len(lines) for lines in together.values())
    print(f"together: {share(together):.1f} % of {count} lines; no reader reaches")
    for name, at in missed(together):
        print(f"  {name}: {ranges(at)}")


if sys.argv[1] == "--together":
    tell_all(sys.argv[2:])
else:
    tell_one(*sys.argv[1:4])
