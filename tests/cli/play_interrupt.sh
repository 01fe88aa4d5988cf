#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The player asked to stop: by Ctrl-C, by kill, by a terminal that closes. Exit code 130, nothing
# written, nothing left; and what a killed one could not clear, the next one sweeps.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet
script_of() {  # FRAMES
  cat <<END_OF_SCRIPT
{"schema": "organbake/interaction/1", "name": "s", "time_step_s": 0.02, "frames": $1,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                          {"frame": 100000, "azimuth_rad": 6, "elevation_rad": 0}]},
 "instruments": []}
END_OF_SCRIPT
}
script_of 100000 >long.json
script_of 2 >short.json

set -m  # a job of its own: a shell without job control has background jobs ignore SIGINT
stopped() {  # SIGNAL ARGUMENTS…
  local signal=$1 victim code=0
  shift
  "$BIN/organplay" "$@" >out 2>err &
  victim=$!
  sleep 0.5
  kill -"$signal" $victim
  wait $victim || code=$?
  expect_equal "$code" 130
  expect_err "interrupted"
  expect_equal "$(cat out)" ""
  expect_equal "$(leftovers "$WORK")" ""
}
# One frame of several seconds: nothing asks while it is drawn.
for signal in INT TERM HUP; do
  stopped $signal b -o k.png --size 8000x8000
  expect_gone k.png
done
stopped HUP b --script long.json --out frames --size 64x48
expect_gone frames

# nohup: a terminal may close.
trap '' HUP
"$BIN/organplay" b -o k.png --size 2000x2000 >out 2>err &
victim=$!
sleep 0.2
kill -HUP $victim
wait $victim || fail "a SIGHUP that is ignored ended it: $(cat err)"
trap - HUP

command -v ffmpeg >/dev/null || { echo "SKIPPED: ffmpeg is not installed"; exit 0; }
# To all of a terminal's programs, as Ctrl-C is: ffmpeg's end is not the reason.
"$BIN/organplay" b --script long.json --video v.mp4 --size 64x48 >out 2>err &
victim=$!
sleep 1
kill -INT -$victim
code=0
wait $victim || code=$?
expect_equal "$code" 130
expect_err "interrupted"
expect_equal "$(leftovers "$WORK")" ""

for ending in mp4 mkv mov webm avi; do
  "$BIN/organplay" b --script long.json --video v.$ending --size 64x48 >out 2>err &
  victim=$!
  for _ in $(seq 100); do [ -n "$(leftovers "$WORK")" ] && break; sleep 0.1; done
  kill -KILL $victim
  wait $victim 2>/dev/null
  [ -n "$(leftovers "$WORK")" ] || fail "v.$ending is written under its own name"
  expect 0 "$BIN/organplay" b --script short.json --video v.$ending --size 64x48 --quiet
  expect_equal "$(leftovers "$WORK")" ""
  expect_equal "$(ls -A | grep '^\..*v\.')" ""
  [ -s v.$ending ] || fail "no v.$ending"
done
true
