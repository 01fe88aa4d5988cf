#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Volumes of any kind of number, and masks as programs write them: on grids of their own, with NaN,
# as channels, as a folder of files, as contours and segments. Each case has its right value.
source "$(dirname "$0")/assert.sh"
python3 "$SOURCE/tests/cli/make_masks.py" "$WORK" || exit 1
figure() { python3 -c 'import json, sys; print(json.load(open("out"))["report"]["figures"][sys.argv[1]])' "$1"; }
near() { python3 -c "import sys; sys.exit(not abs($1 - $2) <= $3)" || fail "$1 is not $2 ± $3"; }
centre() { python3 "$SOURCE/tests/cli/surface_centre.py" "$@" || fail "centre of $1"; }

# One organ by masks of several kinds: the same 57 ml in the same place.
for mask in mask.nii mask_nan.nii mask_double.nii; do
  expect 0 organbake isosurface ct.nii --mask $mask -o organ.ply --json
  near "$(figure volume_ml)" 56.55 0.2
  centre organ.ply -8 2 96
done
expect 0 organbake isosurface ct.nii --mask mask_shifted.nii -o organ.ply --json
near "$(figure volume_ml)" 56.55 0.2
centre organ.ply -8 2 96
expect 0 organbake isosurface ct.nii --mask wide.nii --label 40000 -o organ.ply --json
near "$(figure volume_ml)" 56.55 0.2
expect 65 organbake isosurface ct.nii --mask far.nii -o x.ply
expect_err "no voxel of label 1 lies inside the CT"

# Every level of a volume from nought to one has a surface of its own.
for level in 0.2:147.4 0.5:113.1 0.8:84.5; do
  expect 0 organbake isosurface zero_to_one.nii --iso ${level%:*} -o level.ply --json
  near "$(figure volume_ml)" ${level#*:} 0.3
done
grep -q rounded err && fail "values were rounded"

# What the largest piece leaves out is said.
expect 0 organbake isosurface ct.nii --mask kidneys.nii -o one.ply --json
expect_err "1 of 2 pieces of the surface were kept: 41"
near "$(figure left_out_share)" 0.414 0.01
expect 0 organbake isosurface ct.nii --mask kidneys.nii --largest 0 -o both.ply --json
near "$(figure left_out_share)" 0 0.001
grep -q "left out" err && fail "nothing was left out: $(cat err)"

# A label needs a mask.
expect 2 organbake isosurface ct.nii --label liver -o x.ply
expect_err "there is no mask"
printf 'schema: organbake/recipe/1\nname: x\n' >r.yaml
expect 78 organbake bake r.yaml --set ct=ct.nii --set label=1 -o x
expect_err "there is no mask"

# Channels: the advice works, a time is the CT's.
expect 65 organbake isosurface ct.nii --mask one_hot.nii -o x.ply
expect_err '--label "channel 1" … "channel 2"'
expect 0 organbake isosurface ct.nii --mask one_hot.nii --label "channel 2" -o organ.ply --json
near "$(figure volume_ml)" 56.55 0.2
expect 0 organbake isosurface ct.nii --mask one_hot.nii --time 1 --label "channel 2" -o organ.ply
expect 65 organbake isosurface ct.nii --mask one_hot.nii --time 1 -o x.ply
expect 2 organbake isosurface ct.nii --mask one_hot.nii --time 2 --label "channel 2" -o x.ply
expect_err "no --time 2"
expect 0 organbake isosurface ct.nii --mask one_hot.nii --label-names dataset.json --label liver -o named.ply
expect_same named.ply organ.ply

# nnU-Net's names, of both versions, and a region of several labels.
for names in dataset.json dataset_1.json; do
  expect 0 organbake isosurface ct.nii --mask mask.nii --label-names $names --label Liver -o named.ply --json
  near "$(figure volume_ml)" 56.55 0.2
done
expect 0 organbake isosurface --mask two_labels.nii --label-names regions.json --label kidneys --largest 0 -o both.ply --json
expect 65 organbake isosurface --mask mask.nii --label-names broken.json -o x.ply
expect_err "broken.json"

# A folder of masks, one file each.
expect 0 organbake isosurface ct.nii --mask organs --label liver -o liver.ply --json
near "$(figure volume_ml)" 56.55 0.2
expect 65 organbake isosurface ct.nii --mask organs -o x.ply
expect_err "1 kidneys, 2 liver"
expect 0 organbake isosurface --mask organs --each-label --largest 0 -o each
expect_equal "$(ls each | tr '\n' ' ')" "kidneys.ply liver.ply report.json "
expect 0 organbake inspect organs --json
python3 -c 'import json; l = json.load(open("out"))["labels"]; assert l[1].startswith("2 liver: 56.") , l' || fail "$(cat out)"

# An organ that ends with the volume: said, and closed round on request.
expect 0 organbake isosurface --mask half.nii -o flat.ply --json
expect_err "reaches the volume's end over"
flat=$(figure volume_ml)
expect 0 organbake isosurface --mask half.nii --cap round -o round.ply --json
# The dome may be a twentieth of the organ.
python3 -c "assert 1.03 * $flat < $(figure volume_ml) < 1.06 * $flat" || fail "round: $flat, $(figure volume_ml)"
expect 0 organbake isosurface --mask half.nii --no-cap -o open.ply
printf 'schema: organbake/recipe/1\nname: x\ninputs: {mask: half.nii}\nisosurface: {cap: true}\n' >r.yaml
expect 0 organbake bake r.yaml --to isosurface -o old.ply
expect_same old.ply flat.ply
expect 0 organbake bake r.yaml --set isosurface.cap=round --to isosurface -o new.ply
expect_same new.ply round.ply

# Contours: overlapping ones are united, twice is once, a hole is said, planes keep their places.
expect 0 organbake isosurface --mask contours.dcm --label UNION -o organ.ply --json
near "$(figure volume_ml)" 118.1 0.6
expect 0 organbake isosurface --mask contours.dcm --label TWICE -o organ.ply --json
near "$(figure volume_ml)" 98.17 0.5
expect_err "20 contours are there twice and count once"
expect 0 organbake isosurface --mask contours.dcm --label HOLE -o organ.ply --json
near "$(figure volume_ml)" 62.83 0.5
expect_err "20 contours lie inside others and are taken as holes"
expect 0 organbake isosurface --mask contours.dcm --label BETWEEN -o organ.ply
centre organ.ply 0 0 95
expect 65 organbake isosurface --mask contours.dcm --label LOBE -o x.ply
expect_err 'the labels 5 and 6 are both called "LOBE"'
expect 0 organbake isosurface --mask contours.dcm --label 6 -o organ.ply

# A label map that lists its background.
expect 0 organbake inspect labelmap.dcm --json
python3 -c 'import json; l = json.load(open("out"))["labels"]; assert len(l) == 1 and l[0].startswith("1 block"), l' || fail "$(cat out)"

# IBSI's digital phantom: the textbook's surface from mask, contours and segments; else the voxels'.
DATA=$SOURCE/../shared/data/ibsi_digital_phantom
if [ -d "$DATA" ]; then
  for mask in "$DATA/mask.nii.gz" ibsi_edges.dcm ibsi_half_way.dcm ibsi_seg.dcm; do
    expect 0 organbake isosurface "$DATA/phantom.nii.gz" --mask "$mask" \
      --smooth-mm 0 --largest 0 --no-keep-volume -o ibsi.ply --json
    near "$(figure volume_ml)" 0.556 0.004
    expect 0 organbake inspect ibsi.ply --json
    python3 - <<'END' || fail "$mask: $(cat out)"
import json
figures = json.load(open('out'))
assert abs(figures['area_mm2'] - 388) <= 3, figures
END
    expect 0 organbake isosurface "$DATA/phantom.nii.gz" --mask "$mask" -o ibsi.ply --json
    near "$(figure volume_ml)" 0.592 0.004
  done
else
  echo "REAL DATA MISSING: $DATA"
fi
