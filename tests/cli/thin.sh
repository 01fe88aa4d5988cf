#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A thin branching organ, as hepatic veins are: a proxy that does not serve is not passed over.
source "$(dirname "$0")/assert.sh"
python3 - <<'PY'
import math
# Four generations of tubes on a plane grid of 1 mm, from 4 mm of radius down to 2.
n, tubes = 96, []
def grow(at, angle, radius, length, left):
    end = (at[0] + length * math.cos(angle), at[1] + length * math.sin(angle), at[2])
    tubes.append((at, end, radius))
    if left:
        for turn in (-0.6, 0.6):
            grow(end, angle + turn, 0.8 * radius, 0.8 * length, left - 1)
grow((8, n / 2, 12), 0, 4, 26, 2)
def inside(p):
    for a, b, r in tubes:
        d = [b[i] - a[i] for i in range(3)]
        t = max(0, min(1, sum((p[i] - a[i]) * d[i] for i in range(3)) / sum(x * x for x in d)))
        if sum((p[i] - a[i] - t * d[i]) ** 2 for i in range(3)) <= r * r:
            return 1
    return 0
voxels = bytes(inside((x, y, z)) for z in range(24) for y in range(n) for x in range(n))
open("veins.mha", "wb").write((f"ObjectType = Image\nNDims = 3\nDimSize = {n} {n} 24\nElementSpacing = 1 1 1\n"
    "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n").encode() + voxels)
PY
expect 0 organbake isosurface --mask veins.mha --label 1 -o veins.ply --quiet
surface=veins.ply

# As few faces as an organ's lose branches: said, and --strict ends with 3; the proxy is there.
expect 0 organbake decimate "$surface" --faces 40 -o few.ply --quiet
expect_err "it does not serve there"
expect 3 organbake decimate "$surface" --faces 40 -o few.ply --quiet --strict
[ -s few.ply ] || fail "nothing was written"

# auto: within 5 % of each part's own thickness, or it says that it cannot.
expect 0 organbake decimate "$surface" --faces auto -o auto.ply --json --quiet
python3 - out <<'PY' || fail "faces = auto"
import json, sys
told = json.load(open(sys.argv[1]))
figures = told["report"]["figures"]
assert 1 < figures["worst_thickness_mm"] < 5, figures
assert figures["faces"] <= 6000
served = figures["worst_share_of_thickness"] <= 0.05
assert served == (not any("mm off" in w for w in told["warnings"])), told["warnings"]
assert figures["worst_share_of_thickness"] < 0.2, figures
PY
