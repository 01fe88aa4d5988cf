#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Cameras for a coverage, and what every placement tells.
source "$(dirname "$0")/assert.sh"
small_phantom p

expect 0 organbake place p/truth.ply --count 4 --size-px 32 --report full -o four
expect 0 organbake place p/truth.ply --coverage 0.98 --candidates 200 --samples 1000 --size-px 32 --report full -o fewest
python3 - <<'PY' || fail "a report of place"
import json
four, fewest = (json.load(open(f"{d}/report.json"))["figures"] for d in ("four", "fewest"))
for figures in (four, fewest):
    assert figures["seen_by_1_share"] >= figures["seen_by_2_share"] >= figures["seen_by_3_share"]
    assert figures["views"] >= 500 and len(figures["view_gap_mean_poked"]) == 3
    assert figures["median_texel_mm"] > 0
assert four["cameras"] == 4 and "cameras_for_coverage" not in four
assert fewest["seen_by_2_share"] > 0.97 > four["seen_by_2_share"]
assert fewest["cameras_for_coverage"] <= fewest["cameras"]
PY
[ -s fewest/seen.ply ] || fail "no seen.ply"
expect 0 organbake inspect fewest/seen.ply

# The brief report agrees with the full one as far as a quarter of the samples can.
expect 0 organbake place p/truth.ply --count 4 --size-px 32 -o brief
python3 - <<'PY' || fail "the brief report"
import json
brief, full = (json.load(open(f"{d}/report.json")) for d in ("brief", "four"))
assert "views" not in brief["figures"] and any("seen.ply" in s["what"] for s in brief["skipped"])
# Of 4,096 samples: three standard errors of a share near one half are 0.024.
for key in ("seen_by_1_share", "seen_by_2_share", "seen_by_3_share", "reachable_share"):
    assert abs(brief["figures"][key] - full["figures"][key]) < 0.024, key
PY
expect_gone brief/seen.ply
expect_same brief/cameras.json four/cameras.json

expect 2 organbake place p/truth.ply --coverage 1.5 -o x
expect_err "coverage"
expect_gone x
expect 2 organbake place p/truth.ply --coverage 0.2 -o x
expect_err "0.5…1"
expect 65 organbake place p/truth.ply --coverage 0.9 --texel-mm 0.0001 --candidates 50 --samples 200 -o x
expect_err "allow larger texels"
expect_gone x
# A hemisphere, and the same bytes again on one thread.
region=(--coverage 0.9 --candidates 100 --samples 500 --cone-angle-deg 90 --size-px 32)
expect 0 organbake place p/truth.ply "${region[@]}" -o half
ORGANBAKE_CACHE=$PWD/other expect 0 organbake place p/truth.ply "${region[@]}" --threads 1 -o again
checksums half >half.sums
checksums again >again.sums
expect_same half.sums again.sums
