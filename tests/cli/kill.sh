#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# kill -9 at 12 random moments: every rerun ends in the same bytes, with nothing left of the dead.
# ORGANBAKE_KILLS=100 for the long form; at each system call: scripts/faults kill.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o whole --cache whole-cache
expect 0 organbake verify whole
start=$(milliseconds)
expect 0 organbake bake r.yaml -o timed --cache timed-cache
total=$(($(milliseconds) - start))

RANDOM=${ORGANBAKE_SEED:-7}
for i in $(seq "${ORGANBAKE_KILLS:-12}"); do
  # Half of them from an empty cache: early moments count as much as late ones.
  [ $((i % 2)) -eq 0 ] && rm -rf "$ORGANBAKE_CACHE" b
  moment=$((RANDOM % (total + 1)))
  "$BIN/organbake" bake r.yaml -o b --quiet >/dev/null 2>&1 &
  victim=$!
  sleep_ms $moment
  kill -9 $victim 2>/dev/null
  wait $victim 2>/dev/null
  if [ -e b ]; then expect_same whole b; fi
  expect 0 organbake bake r.yaml -o b --quiet
  expect_same whole b
  expect_equal "$(leftovers "$WORK")" ""
  rm -rf b
done
