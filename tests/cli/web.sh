#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bundle as one page: its pictures against organplay's, damage, long pokes, and the page in a real
# browser. Without the module (scripts/build web) or Node or Chromium it says what was left out.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report --set mechanics.fem=false

module=
for folder in "$BIN/../share/organbake/web" "$BIN/../../web/share/organbake/web"; do
  [ -e "$folder/organ.wasm" ] && module=$folder/organ.wasm
done
if [ -z "$module" ]; then
  refused 66 "scripts/build web" organbake export organ --format web -o made
  refused 66 "scripts/build web --packages FOLDER" organbake export organ --format web -o made
  echo "SKIPPED: the player for pages is not built (scripts/build web)"
  exit 0
fi

expect 0 organbake export organ --format web -o organ.html
expect_out organ.html
expect 0 organbake export organ --format web -o again.html --threads 1
expect_same organ.html again.html
[ "$(stat -c %s organ.html)" -lt 1000000 ] || fail "a small organ's page is $(stat -c %s organ.html) bytes"
[ "$(stat -c %s "$module")" -le 1230000 ] || fail "the module is $(stat -c %s "$module") bytes"
grep -qE 'src=|@import|url\(' organ.html && fail "the page asks for more"
expect 0 organbake export organ --format web -o organ.html  # over its own
mkdir folder
expect 73 organbake export organ --format web -o folder
expect_equal "" "$(leftovers .)"

# A bake and a batch make pages as well, and their own pages link to them.
expect 0 organbake bake r.yaml -o linked --web --set mechanics.fem=false
expect_same organ.html linked_player.html
grep -q 'href="linked_player.html"' linked_report.html || fail "the report does not link to the page"
printf 'case,phantom.seed\nfirst one,1\n' >cases.csv
expect 0 organbake batch cases.csv --recipe r.yaml -o many --web --no-pictures --quiet
[ -s "many/pages/first one.html" ] || fail "no page of the batch's case"
grep -q 'href="pages/first%20one.html"' many/batch.html || fail "the batch's page does not link"
grep -q 'page": "pages/first one.html"' many/batch.json || fail "batch.json does not tell the page"

if ! command -v node >/dev/null; then
  echo "SKIPPED: there is no node here (Debian: nodejs); the module was not run"
  exit 0
fi
script() {  # FRAMES AZIMUTH LIGHT
  cat <<END
{"schema": "organbake/interaction/1", "name": "web", "time_step_s": 0.016666666666666666, "frames": $1,
 "size": [480, 360], "light": "$3", "camera": {"keyframes": [{"frame": 0, "azimuth_rad": $2, "elevation_rad": 0.2}]},
 "instruments": [{"name": "probe", "mode": "poke", "path": [
   {"time_s": 0, "direction": [0, -1, 0], "depth_mm": -2}, {"time_s": 0.1, "direction": [0, -1, 0], "depth_mm": 8},
   {"time_s": 9, "direction": [0, -1, 0], "depth_mm": 8}]}]}
END
}
# 55 dB is what an eye cannot tell; the module's arithmetic has no fused multiply-adds, the pack
# rounds depths to a 128th of a texel.
for seen in "0 baked" "0.5 world" "1.3 baked" "-1.1 world" "2.6 baked"; do
  script 6 $seen >script.json
  rm -rf frames
  expect 0 node "$SOURCE/tests/web/frames.mjs" organ.html script.json frames
  expect 0 "$BIN/organplay" organ --script script.json --reference frames --threshold-db 55
done
# Blades, where there are tetrahedra: the same cut as organplay's, and by hand.
expect 0 organbake bake r.yaml -o cuttable --no-report --set mechanics.fem_cell_mm=8
expect 0 organbake export cuttable --format web -o cuttable.html
cat >cut.json <<END
{"schema": "organbake/interaction/1", "name": "a cut", "time_step_s": 0.016666666666666666, "frames": 30,
 "solver": "fem", "size": [480, 360], "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0.1}]},
 "instruments": [
   {"name": "scalpel", "mode": "cut", "radius_mm": 0.4, "axis_mm": [0, -28, 0], "path": [
     {"time_s": 0.02, "direction": [-0.3, -1, 0.05], "depth_mm": 14},
     {"time_s": 0.2, "direction": [0.3, -1, 0.05], "depth_mm": 14}]},
   {"name": "forceps", "mode": "grab", "radius_mm": 4, "path": [
     {"time_s": 0.3, "direction": [0, -1, 0.2], "depth_mm": 2},
     {"time_s": 0.48, "direction": [0, -1, 0.4], "depth_mm": -3}]}]}
END
rm -rf frames
expect 0 node "$SOURCE/tests/web/frames.mjs" cuttable.html cut.json frames
# 50 dB: where an outline runs along a row of pixels, the last bit decides on which side that row lies.
expect 0 "$BIN/organplay" cuttable --script cut.json --reference frames --threshold-db 50
expect 0 node "$SOURCE/tests/web/cut.mjs" cuttable.html
expect_out "cut, snipped, pierced"
expect_out "undone, done again"
expect 0 node "$SOURCE/tests/web/cut.mjs" organ.html
expect_out "no blades"
expect 0 node "$SOURCE/tests/web/states.mjs" cuttable.html
expect_out "states are drawn"
expect 1 node "$SOURCE/tests/web/frames.mjs" organ.html cut.json none
expect_err "has no tetrahedra"
expect 0 node "$SOURCE/tests/web/poke_long.mjs" cuttable.html 500
expect 0 node "$SOURCE/tests/web/damage.mjs" organ.html 100
expect 0 node "$SOURCE/tests/web/poke_long.mjs" organ.html 1500
expect 0 node "$SOURCE/tests/consumer/web/measure.mjs" organ.html
expect_out "newtons"

for shown in page graphics headset; do
  code=0
  node "$SOURCE/tests/web/${shown}_in_browser.mjs" "$WORK/cuttable.html" >$shown.log 2>&1 || code=$?
  cat $shown.log
  [ $code -eq 0 ] || [ $code -eq 77 ] || fail "${shown}_in_browser.mjs in Chromium"
done
