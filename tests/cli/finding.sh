#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Things are found by name: recipes, materials, a user's defaults, what lies in a patient's folder,
# and what a shell completes.
source "$(dirname "$0")/assert.sh"

expect 0 organbake recipes
for name in liver laparoscopy phantom abdomen video_archive; do expect_out "$name "; done
expect 0 organbake recipes liver
cp out mine.yaml
expect 0 organbake verify mine.yaml --quiet
expect 0 organbake bake phantom --dry-run
expect_out "phantom: to run"
mkdir liver  # a folder of that name is no recipe
expect 78 organbake bake liver --dry-run
expect_err "lacks its input 'ct'"
refused 66 "did you mean 'liver'? ('organbake recipes' lists them)" organbake bake livr -o made
refused 66 "did you mean 'abdomen'?" organbake batch x.mha --recipe abdomn -o made

expect 0 organbake materials --json
python3 -c 'import json; assert "spleen" in json.load(open("out"))["materials"]' || fail "materials"
expect 0 organbake materials -o sheet.png --side-px 32 --columns 9
python3 - <<'END' || fail "the sheet of materials"
import struct, zlib
data = open("sheet.png", "rb").read()
assert struct.unpack(">II", data[16:24]) == (9 * 32, 32), data[:32]
packed, at = b"", 8
while at < len(data):
    size, kind = struct.unpack(">I4s", data[at:at + 8])
    packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
    at += size + 12
rows = zlib.decompress(packed)
assert len(set(rows)) > 60, "swatches of one colour"
END

# A user's defaults; a flag goes before them.
small_recipe >r.yaml
mkdir -p config/organbake
printf '# mine\n\nthreads = 1\ncache = %s/own\n' "$WORK" >config/organbake/config
expect 0 env -u ORGANBAKE_CACHE "$BIN/organbake" bake r.yaml --to phantom -o p
[ -n "$(ls own)" ] || fail "the configured cache was not taken"
expect 0 organbake bake r.yaml --to phantom -o p
[ -n "$(ls "$ORGANBAKE_CACHE")" ] || fail "ORGANBAKE_CACHE does not go first"
printf 'threads = 1\ncolour = never\n' >config/organbake/config
for program in organbake organplay organbench; do
  expect 2 "$BIN/$program" --help
  expect_err "config/organbake/config, line 2: unknown key 'colour'; did you mean 'color'?"
done
echo 'threads = many' >config/organbake/config
expect 2 organbake doctor
expect_err "line 1: threads: 'many' is not possible; it takes a whole number, 0…4096"
echo 'color = always' >config/organbake/config
expect 66 organbake inspect missing
grep -q "$(printf '\033')\[31morganbake: error" err || fail "no colour where it is always asked for"
rm -r config

# A folder of one's own data: to the bundle in two commands.
small_phantom s
mkdir -p patient/scans
cp s/ct.mha patient/scans/scan.mha
expect 0 organbake isosurface s/ct.mha -o s.ply --quiet
python3 - <<'END'
import re
head, data = open("s/ct.mha", "rb").read().split(b"ElementDataFile = LOCAL\n", 1)
import array, zlib
raw = zlib.decompress(data) if b"CompressedData = True" in head else data
values = array.array("h", raw)
mask = bytes(5 if v > -470 else 0 for v in values)
head = re.sub(rb"ElementType = \w+", b"ElementType = MET_UCHAR", head)
head = re.sub(rb"CompressedData.*\n", b"", head)
open("patient/scans/organs.mha", "wb").write(head + b"ElementDataFile = LOCAL\n" + mask)
END
: >patient/damaged.nii.gz
expect 0 organbake new patient
expect_err "damaged.nii.gz: passed over, it cannot be read: "
expect_err "next: organbake bake patient.yaml -o patient_bundle"
grep -q '^  label: 5 ' patient.yaml || fail "the label: $(cat patient.yaml)"
grep -q 'cap: round' patient.yaml || fail "the cap: $(cat patient.yaml)"
expect 0 organbake verify patient.yaml --quiet
expect 0 organbake bake patient.yaml -o bundle --quality draft --set place.count=4 --set place.size_px=48
expect 0 organbake verify bundle --quiet
refused 73 "patient.yaml: is there already" organbake new patient
mkdir -p patient/second
cp s/ct.mha patient/second/other.mha
expect 0 organbake new patient -o all.csv
expect_equal "$(head -1 all.csv)" "case,capture.material,ct,label,mask"
expect_equal "$(wc -l <all.csv)" 3
mkdir nothing
expect 0 organbake new s/ct.mha -o alone.yaml
grep -q "Without a mask, everything over" alone.yaml || fail "$(cat alone.yaml)"
mkdir damaged && mv patient/damaged.nii.gz damaged
expect 2 organbake new damaged -o made
expect_err "no scan, clip or surface is there that can be read"
expect_gone made
refused 66 "nothing: holds no scan, clip or surface" organbake new nothing -o made

# What the shells offer.
expect 0 organbake completions bash
cp out completions
complete_word() {
  bash -c 'source completions; COMP_WORDS=(organbake "$@"); COMP_CWORD=$#; _organbake
           printf "%s\n" "${COMPREPLY[@]}"' - "$@"
}
complete_word bake lapa | grep -qx laparoscopy || fail "a recipe"
complete_word batch --recipe lapa | grep -qx laparoscopy || fail "a recipe behind its option"
complete_word man isos | grep -qx isosurface || fail "a stage"
complete_word capture --material sple | grep -qx spleen || fail "a material"
complete_word bake --qual | grep -qx -- --quality || fail "an option"
true
