#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What stages warn of: on stderr, in the JSON, in the batch's table and on the page, one list, whether
# they ran or came from the cache; and --strict.
source "$(dirname "$0")/assert.sh"
# So few faces do not have the organ's shape, for certain.
{ small_recipe | sed 's/faces: 60/faces: 8, method: lindstrom-turk/'; } >r.yaml
shape="decimate: the proxy lies up to"

warnings() { python3 -c 'import json, sys; print("\n".join(json.load(open(sys.argv[1]))["warnings"]))' "$1"; }
expect 0 organbake bake r.yaml -o organ --json
expect_err "warning: $shape"
warnings out >ran
grep -qF "$shape" ran || fail "the JSON lacks it: $(cat ran)"
expect_equal "$(grep '^warning: ' err | cut -d' ' -f2- | sort)" "$(sort ran)"
expect 0 organbake bake r.yaml -o organ --json --quiet
expect_err "warning: $shape"
expect_equal "$(warnings out)" "$(cat ran)"
python3 - ran <<'PY' || fail "the page has other warnings"
import html, re, sys
page = open("organ_report.html", encoding="utf-8").read()
listed = re.search(r'<div class="warnings">.*?<ul>(.*?)</ul>', page, re.S)[1]
assert [html.unescape(w) for w in re.findall("<li>(.*?)</li>", listed)] == open(sys.argv[1]).read().splitlines()
PY
expect 0 organbake verify organ --json
expect_err "warning: $shape"
warnings out | grep -qF "$shape" || fail "verify does not tell it"

# A stage alone tells the same, run or cached.
expect 0 organbake phantom -o p --size-voxels 40,40,16 --photos 3 --photo-size-px 96 --truth-subdivisions 3
for i in 1 2; do
  expect 0 organbake decimate p/truth.ply --faces 8 --method lindstrom-turk -o proxy.ply --json --quiet
  expect_err "warning: $shape"
  warnings out | grep -qF "$shape" || fail "the stage's JSON lacks it"
done

# --strict: exit code 3, and the result is there.
expect 3 organbake decimate p/truth.ply --faces 8 --method lindstrom-turk -o strict.ply --strict
[ -s strict.ply ] || fail "nothing was written"
expect 3 organbake bake r.yaml -o strict --strict
expect_same strict organ
expect 0 organbake decimate p/truth.ply --faces 300 -o good.ply --strict

# A batch: the table, the JSON and the page.
printf 'case,decimate.method,decimate.faces\nwarned,lindstrom-turk,8\n' >cases.csv
expect 0 organbake batch cases.csv --recipe r.yaml -o batch --no-pictures
expect_err "warning: batch: warned: $shape"
python3 - <<'PY' || fail "the batch's table, JSON or page"
import csv, html, json
told = open("ran").read().splitlines()
assert json.load(open("batch/batch.json"))["cases"][0]["warnings"] == told
assert next(csv.DictReader(open("batch/batch.csv")))["warnings"] == "; ".join(told)
page = html.unescape(open("batch/batch.html", encoding="utf-8").read())
assert all(w in page for w in told)
PY
expect 0 organbake verify batch/batch.json
expect 4 organbake batch cases.csv --recipe r.yaml -o batch --no-pictures --strict
expect_equal "$(grep -c '^warned,unchanged,3,' batch/batch.csv)" 1

# Maps that show nothing, whole as they are.
python3 - <<'PY'
import math, pathlib, struct
def exr(width, height, channels):  # name, type (1 half, 2 float, 0 uint), bytes of one value
    attribute = lambda name, kind, data: name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data
    listed = b"".join(n + b"\0" + struct.pack("<iB3xii", t, 0, 1, 1) for n, t, _ in channels) + b"\0"
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<ii", 20000630, 2) + attribute(b"channels", b"chlist", listed) + \
        attribute(b"compression", b"compression", b"\0") + attribute(b"dataWindow", b"box2i", box) + \
        attribute(b"displayWindow", b"box2i", box) + attribute(b"lineOrder", b"lineOrder", b"\0") + \
        attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) + \
        attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)) + \
        attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    line = b"".join(v * width for _, _, v in channels)
    first = len(head) + 8 * height
    offsets = b"".join(struct.pack("<Q", first + y * (8 + len(line))) for y in range(height))
    return head + offsets + b"".join(struct.pack("<ii", y, len(line)) + line for y in range(height))
far, none = struct.pack("<f", math.inf), struct.pack("<I", 0xFFFFFFFF)
half, zero = b"\0\0", struct.pack("<f", 0)
import shutil
for name, cameras in (("empty", 4), ("one", 1)):
    shutil.copytree("organ", name)
    for c in range(cameras):
        folder = pathlib.Path(name) / f"cam_{c:03}"
        (folder / "depth.exr").write_bytes(exr(48, 48, [(b"Y", 2, far), (b"Z", 2, far)]))
        (folder / "color.exr").write_bytes(exr(48, 48, [(n, 1, half) for n in (b"A", b"B", b"G", b"R")]))
        (folder / "micro.exr").write_bytes(
            exr(48, 48, [(b"Y", 2, zero), (b"confidence", 1, half), (b"face", 0, none)]))
PY
expect 0 organbake reseal one
expect 0 organbake verify one
expect_err "maps that show nothing of the organ: cam_000"
expect 0 organbake reseal empty
expect 65 organbake verify empty
expect_err "empty: the maps of all its cameras are empty"

# Two bakes into one place: the second waits, and the last one's bundle is there, whole.
expect 0 organbake bake r.yaml -o warm --no-report
for round in 1 2 3; do
  codes=
  for faces in 24 28 32; do
    organbake bake r.yaml --set decimate.faces=$faces -o together --quiet >/dev/null 2>"log$faces" &
    pids[$faces]=$!
  done
  for faces in 24 28 32; do
    wait "${pids[$faces]}" || fail "of three bakes into one place, one failed: $(cat "log$faces")"
  done
  expect 0 organbake verify together
  grep -q "$(sha256sum <together/manifest.json | cut -d' ' -f1)" together_report.html ||
    fail "the page is of another bundle"
done
expect_equal "$(leftovers .)" ""
expect_equal "$(find . -name '*.lock')" "./batch/logs/batch.lock"
