#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What organplay says on stdout: lines, or one JSON object; and that it got there.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --set bundle.surface=true --quiet
cat >s.json <<'END'
{"schema": "organbake/interaction/1", "name": "s", "time_step_s": 0.02, "frames": 2,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]}, "instruments": []}
END
play() { "$BIN/organplay" b --size 64x48 --quiet "$@"; }
says() {  # PYTHON, of what was printed, read as JSON: r
  python3 -c "import json; r = json.load(open('out')); assert $1, r" || fail "--json: $1"
}

expect 0 play --script s.json --out frames --report p.json -o k.png --sheet sheet.png
expect_equal "$(tr '\n' ' ' <out)" "frames p.json k.png sheet.png "
expect 0 play --script s.json --out frames --report p.json -o k.png --sheet sheet.png --json
says "r == {'out': 'frames', 'report': 'p.json', 'frame': 'k.png', 'sheet': 'sheet.png'}"
expect 0 play -o k.png --json
says "r == {'frame': 'k.png'}"
# Names need not be UTF-8.
expect 0 play -o "$(printf 'k\377.png')" --json
says "r['frame'].startswith('k')"

expect 0 play --script s.json --reference frames --json
says "r == {'reference': {'folder': 'frames', 'least_psnr_db': None, 'worst_frame': None,
                          'threshold_db': 45, 'passed': True}}"
expect 3 play --script s.json --reference frames --threshold-db 1000 --warp paper --json
says "not r['reference']['passed'] and r['reference']['least_psnr_db'] < 1000"
expect_sentence
expect 0 play --compare --angles-deg 0,30 --json
says "r['schema'] == 'organbake/comparison/1' and len(r['rows']) == 4"
expect 0 play --compare --angles-deg 0 -o k.png --json
says "r['frame'] == 'k.png' and r['comparison']['schema'] == 'organbake/comparison/1'"
expect 0 play --bench 2 --json
says "r['width'] == 64 and r['frames'] == 2"
expect 0 play --bench 2
expect_out "frames per second at 64x48"

# A result that its reader does not get is an error.
into_a_full_disk() { "$@" >/dev/full; }
for asked in "-o k.png" "-o k.png --json" "--compare --angles-deg 0" "--compare --angles-deg 0 --json" \
  "--bench 2" "--bench 2 --json" "--script s.json --out frames" "--sheet k.png" --help --version; do
  expect 73 into_a_full_disk play $asked
  expect_err "stdout: cannot be written: No space left on device"
  expect_sentence
done
for asked in --help --version schema "schema interaction" "inspect b"; do
  expect 73 into_a_full_disk organbake $asked
  expect_err "stdout: cannot be written"
done
# A limit on files' sizes is one, too.
limited() { (ulimit -f 1; play "$@"); }
expect 73 limited --sheet large.png
expect_sentence
expect_gone large.png
expect_equal "$(leftovers "$WORK")" ""
