#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The isosurface stage's options as users give them.
source "$(dirname "$0")/assert.sh"
small_phantom p

figure() { python3 -c 'import json, sys; print(json.load(open("out"))["report"]["figures"][sys.argv[1]])' "$1"; }

# A level from the histogram: between air at -1000 and silicone at 60 HU.
expect 0 organbake isosurface p/ct.mha --iso auto -o auto.ply --json
expect_err "half-way between the peaks at"
level=$(figure level_hu)
python3 -c "assert abs($level + 470) < 20, $level" || fail "level $level"
expect 2 organbake isosurface p/ct.mha --iso automatic -o x.ply
expect_err "auto or a number"

# What was a setting once is told, and left out.
expect 0 organbake isosurface p/ct.mha --iso -470 --method marching-cubes -o fast.ply
expect_err "method is no longer a setting"
expect 0 organbake isosurface p/ct.mha --iso -470 --refine -o refined.ply
expect 65 organbake isosurface p/ct.mha --iso -470 --min-size-mm 900 -o none.ply
expect_err "no piece of the surface"
expect_gone none.ply

# A region of interest, for the surface and for inspect.
expect 0 organbake isosurface p/ct.mha --iso -470 --roi-mm=6,-14,24,18,-2,36 -o part.ply --json
python3 -c "assert 0 < $(figure volume_ml) < 8" || fail "volume of the region: $(figure volume_ml)"
expect 0 organbake inspect p/ct.mha --roi-mm=6,-14,24,18,-2,36 --json
python3 -c 'import json; assert max(json.load(open("out"))["size_voxels"]) < 20' || fail "inspect --roi"
expect 2 organbake inspect p/ct.mha --roi-mm 1,2,3
expect_err "x0,y0,z0,x1,y1,z1"
expect 65 organbake inspect p/ct.mha --roi-mm 900,900,900,950,950,950
expect_err "lies outside the volume"

# Series are a matter of DICOM folders.
expect 2 organbake isosurface p/ct.mha --series 3 -o x.ply
expect_err "only a DICOM folder has series"

# auto and numbers are recipe values, too.
small_recipe >r.yaml
expect 0 organbake bake r.yaml --set isosurface.iso=auto --to isosurface -o b
expect 78 organbake bake r.yaml --set isosurface.iso=warm --to isosurface -o b

# A hollow organ's label keeps its cavity; in metres taken for millimetres it is questioned. Its mass
# is its volume's, and not that of the springs' membrane.
python3 - <<'PY'
import itertools
n = 40
inside = lambda v: 9 <= sum((c - (n - 1) / 2) ** 2 for c in v) ** 0.5 < 16
mask = bytes(inside((x, y, z)) for z, y, x in itertools.product(range(n), repeat=3))
for name, spacing in (("hollow.mha", 2), ("small.mha", 0.2)):
    head = (f"ObjectType = Image\nNDims = 3\nDimSize = {n} {n} {n}\nElementSpacing = {spacing} {spacing} {spacing}\n"
            "Offset = 0 0 0\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n")
    open(name, "wb").write(head.encode() + mask)
open("ml", "w").write(str(sum(mask) * 8 / 1000))
PY
expect 0 organbake isosurface --mask hollow.mha -o hollow.ply --json
grep -q "^warning" err && fail "a sound hollow organ: $(cat err)"
expect_equal "$(figure components_found)" 1
python3 -c "assert abs($(figure volume_ml) / $(cat ml) - 1) < 2e-3" || fail "hollow: $(figure volume_ml) ml of $(cat ml)"
expect 0 organbake mechanics hollow.ply -o hollow.json --density-kg-per-m3 1000 --no-fem --json
python3 -c "assert abs($(figure mass_kg) * 1000 / $(cat ml) - 1) < 2e-3, $(figure mass_kg)" || fail "its mass"
expect 0 organbake isosurface --mask small.mha -o small.ply
expect_err "the surface is 6.0 mm across, and the volume 8.0 mm across"
expect_err "in centimetres the surface would be 6"
