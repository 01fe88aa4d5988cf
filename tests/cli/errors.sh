#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Wrong inputs and outputs: the documented code, one clear sentence, nothing left behind.
source "$(dirname "$0")/assert.sh"
small_phantom p

mkdir empty texts
echo "just words" >texts/a.txt
echo "more words" >texts/b.txt
head -c 3000 p/ct.mha >cut.mha
: >empty.ply
echo '{"schema": "organbake/cameras/1", "cameras": [{"name": 5}]}' >bad.json

refused 66 "missing.mha: there is no such file" organbake isosurface missing.mha -o made
refused 66 "empty: is an empty folder" organbake isosurface empty -o made

code=0; organbake isosurface texts -o made --quiet 2>err || code=$?
[ $code -eq 65 ] || [ $code -eq 66 ] || fail "a folder of text files: exit code $code"
expect_err "texts"
expect_sentence
refused 65 "the volume spans" organbake isosurface p/ct.mha --iso 9000 -o made
refused 65 "cut.mha" organbake isosurface cut.mha -o made
refused 65 "empty.ply" organbake decimate empty.ply -o made
refused 65 "values down to −" organbake isosurface --mask p/ct.mha --label 5 -o made
refused 65 "bad.json:1: cameras.0.name is 5; it must be a text" \
  organbake capture p/truth.ply p/truth.ply bad.json -o made
refused 66 "is a folder, a file is needed" organbake decimate p -o made

# What would not fit is said before the work.
camera() {  # NAME SIDE Z_MM
  echo "{\"name\": \"$1\", \"width\": $2, \"height\": $2, \"fx\": $2, \"fy\": $2, \"cx\": 0.5, \"cy\": 0.5,
    \"camera_from_world\": {\"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"translation_mm\": [-14, 8, $3]}}"
}
cameras() {  # COUNT SIDE Z_MM
  local all
  all=$(for i in $(seq "$1"); do camera "c$i" "$2" "$3" && echo ,; done)
  echo "{\"schema\": \"organbake/cameras/1\", \"cameras\": [${all%,}]}"
}
cameras 200 65536 400 >many.json
refused 2 "the maps of 200 cameras take about 38400" organbake capture p/truth.ply p/truth.ply many.json -o made
cameras 1 64 NaN >nowhere.json
refused 65 "nowhere.json" organbake capture p/truth.ply p/truth.ply nowhere.json -o made
# One texel is a map, too.
cameras 1 1 400 >texel.json
expect 0 organbake decimate p/truth.ply -o proxy.ply --quiet
expect 0 organbake capture p/truth.ply proxy.ply texel.json -o texel --quiet
[ -s texel/cam_000/depth.exr ] || fail "a map of 1 x 1 was not written"
cameras 1 64 -400 >away.json
refused 65 "all maps are empty" organbake capture p/truth.ply proxy.ply away.json -o made
refused 66 "there is no such" organbake inspect missing
refused 66 "there is no such" organbake verify missing
refused 2 "verify takes a bundle's folder" organbake verify empty.ply
: >a.png
refused 2 "inspect takes a bundle" organbake inspect a.png
refused 2 "the path of 'surface' is empty" organbake decimate "" -o made
refused 66 "has no manifest.json" organbake verify p

# Outputs. Nobody loses a file to a mistyped -o.
mkdir thesis
echo "years of work" >thesis/chapter1.tex
refused 73 "chapter1.tex, which organbake did not write" organbake place p/truth.ply -o thesis
expect_equal "$(cat thesis/chapter1.tex)" "years of work"
refused 73 "is a file" organbake place p/truth.ply -o thesis/chapter1.tex
refused 73 "is a folder" organbake decimate p/truth.ply -o thesis
refused 73 "not a folder" organbake decimate p/truth.ply -o thesis/chapter1.tex/x.ply
refused 73 "" organbake decimate p/truth.ply -o /proc/organbake/x.ply
refused 73 "" organbake decimate p/truth.ply -o x.ply --cache /proc/organbake
# A folder of our own may be replaced, but not what somebody put into it.
expect 0 organbake place p/truth.ply --count 4 --size-px 32 -o cams
expect 0 organbake place p/truth.ply --count 5 --size-px 32 -o cams
echo mine >cams/notes.txt
refused 73 "notes.txt" organbake place p/truth.ply --count 4 --size-px 32 -o cams
expect_equal "$(cat cams/notes.txt)" mine

expect_equal "$(leftovers "$WORK")" ""
