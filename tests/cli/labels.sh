#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Masks as people have them: labels by name, several at once, each for itself, and over time.
source "$(dirname "$0")/assert.sh"

# Two boxes of 10 mm voxels in a mask: 64 voxels of label 2, 27 of label 5.
python3 - <<'END'
import struct
def mask(path, times=1, step=10.0, first='liver', tissue=None):
    size = (12, 8, 8)
    voxels = bytearray()
    for z in range(size[2]):
        for y in range(size[1]):
            for x in range(size[0]):
                a = 1 <= x < 5 and 1 <= y < 5 and 1 <= z < 5
                b = 7 <= x < 10 and 2 <= y < 5 and 2 <= z < 5
                value = 2 if a else 5 if b else 0
                voxels += bytes([value]) if tissue is None else struct.pack('<h', tissue if value else -1000)
    xml = b'<CaretExtension><Label Key="2"><![CDATA[' + first.encode() + b']]></Label><Label Key="5"><![CDATA[gall bladder]]></Label>'
    if tissue is not None or not first: xml = b''  # names are a mask's
    xml += b' ' * (-len(xml) % 16 + 8)
    h = bytearray(348)
    struct.pack_into('<i', h, 0, 348)
    struct.pack_into('<8h', h, 40, 3 if times == 1 else 4, *size, times, 1, 1, 1)
    struct.pack_into('<2h', h, 70, *((2, 8) if tissue is None else (4, 16)))
    struct.pack_into('<8f', h, 76, 1, 10, 10, 10, 1, 0, 0, 0)
    struct.pack_into('<f', h, 108, 352 + 8 + len(xml))
    h[123] = 2
    struct.pack_into('<h', h, 254, 1)
    for row in range(3):
        struct.pack_into('<4f', h, 280 + 16 * row, *[step * (row == c) for c in range(3)], 0)
    h[344:348] = b'n+1\0'
    open(path, 'wb').write(bytes(h) + b'\1\0\0\0' + struct.pack('<2i', 8 + len(xml), 0) + xml + bytes(voxels) * times)
mask('mask.nii')
mask('times.nii', 2)
mask('lost.nii', 1, 1.0)
import os
for organ in 'gall_bladder', 'Lung Lower Lobe', 'colon':
    os.makedirs(organ + " patient's")
    mask(organ + " patient's/mask.nii", first=organ)
    mask(organ + " patient's/scan.nii", tissue=40)
for organ in 'lung', 'spleen':  # told by the file's name alone
    os.makedirs(organ + " patient's")
    mask(organ + f" patient's/{organ}_mask.nii", first='')
    mask(organ + " patient's/scan.nii", tissue=40)
END
figure() { python3 -c 'import json, sys; print(json.load(open("out"))["report"]["figures"][sys.argv[1]])' "$1"; }
near() { python3 -c "import sys; sys.exit(not abs($1 - $2) <= 0.005 * $2)" || fail "$1 is not $2"; }

expect 0 organbake isosurface --mask mask.nii --label liver -o liver.ply --json
near "$(figure volume_ml)" 64
expect 0 organbake isosurface --mask mask.nii --label 5 -o five.ply --json
near "$(figure volume_ml)" 27
expect 0 organbake isosurface --mask mask.nii --label Gall_Bladder,2 --largest 0 -o both.ply --json
near "$(figure volume_ml)" 91
expect 65 organbake isosurface --mask mask.nii --label spleen -o x.ply
expect_err 'no label "spleen"; it holds 2 liver, 5 gall bladder'
expect 65 organbake isosurface --mask mask.nii --label livver -o x.ply
expect_err 'no label "livver"; did you mean '\''liver'\''? It holds 2 liver, 5 gall bladder'
expect 65 organbake isosurface --mask mask.nii --label 3 -o x.ply
expect_err "no label 3; it holds 2 liver, 5 gall bladder"
expect 2 organbake isosurface --mask mask.nii --label 0 -o x.ply
expect_gone x.ply

# An affine that lost its voxel size is not guessed at.
expect 65 organbake isosurface --mask lost.nii --label liver -o x.ply
expect_err "--unit-affine"
expect 0 organbake isosurface --mask lost.nii --label liver --unit-affine scale -o scaled.ply
expect_err "pixdim's were taken, as asked for"
expect_same scaled.ply liver.ply

# Names from a text of one's own.
printf '# labels\n2 1 2 3 1 1 1 "right lobe"\n' >names.txt
expect 0 organbake isosurface --mask mask.nii --label-names names.txt --label "right lobe" -o lobe.ply
expect_same lobe.ply liver.ply

# Every label, a file each.
expect 0 organbake isosurface --mask mask.nii --each-label -o organs --json
near "$(figure volume_ml_gall_bladder)" 27
expect_same organs/liver.ply liver.ply
expect_equal "$(ls organs | tr '\n' ' ')" "gall_bladder.ply liver.ply report.json "
expect 0 organbake isosurface --mask mask.nii --each-label -o organs

# What a person wants to know first.
expect 0 organbake inspect mask.nii --json
python3 - <<'END' || fail "inspect: $(cat out)"
import json
labels = json.load(open('out'))['labels']
assert labels[0].startswith('2 liver: 64.0 ml, 64 voxels'), labels
assert labels[1].startswith('5 gall bladder: 27.0 ml'), labels
END

# A file over time.
expect 65 organbake isosurface --mask times.nii --label liver -o x.ply
expect_err 'holds 2 volumes of one place'
expect_err "with --time 1…2"
expect 0 organbake isosurface --mask times.nii --time 2 --label liver -o x.ply
expect_same x.ply liver.ply
expect 0 organbake inspect times.nii --json
python3 -c 'import json; assert json.load(open("out"))["time_points"] == 2' || fail "time points"

# In a recipe, number or name.
cat >r.yaml <<END
schema: organbake/recipe/1
name: named
inputs: {mask: mask.nii, label: gall bladder}
END
expect 0 organbake bake r.yaml --to isosurface -o named.ply
expect_same named.ply organs/gall_bladder.ply
expect 0 organbake bake r.yaml --to isosurface --set label=2 -o two.ply
expect_same two.ply liver.ply
expect 78 organbake bake r.yaml --to isosurface --set isosurface.each_label=true -o x.ply

# A recipe for a folder of one's own: the look follows the label's name, and what is printed can be copied.
for look in gall_bladder=gallbladder 'Lung Lower Lobe=plain' colon=bowel lung=plain spleen=spleen; do
  patient="${look%=*} patient's"
  expect 0 organbake new "$patient"
  grep -q "material: ${look#*=}}" "$patient.yaml" || fail "the look: $(cat "$patient.yaml")"
  printed=$(sed -n 's/^next: //p' err)
  expect 0 bash -c "organbake() { printf '%s|' \"\$@\"; }; $printed"
  expect_equal "$(cat out)" "bake|$patient.yaml|-o|${patient}_bundle|"
done
