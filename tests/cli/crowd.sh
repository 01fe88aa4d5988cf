#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Eight bakes at once share an empty cache, and two of them each target; half of them are killed. Who
# is left ends well, and each target is whole or not there. ORGANBAKE_CROWDS=20 for the long form.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
start=$(milliseconds)
expect 0 organbake bake r.yaml -o whole --cache whole-cache --threads 1
total=$(($(milliseconds) - start))

RANDOM=${ORGANBAKE_SEED:-5}
for crowd in $(seq "${ORGANBAKE_CROWDS:-2}"); do
  rm -rf cache b? b?_report.html
  pids=()
  for i in {0..7}; do
    "$BIN/organbake" bake r.yaml -o b$((i / 2)) --quiet --threads 1 >out$i 2>err$i &
    pids+=($!)
  done
  [ $((crowd % 2)) -eq 1 ] || for i in 0 1 2 4; do
    sleep_ms $((RANDOM % (2 * total)))
    kill -9 "${pids[i]}" 2>/dev/null
  done
  for i in {0..7}; do
    code=0
    wait "${pids[i]}" 2>/dev/null || code=$?
    [ $code -eq 0 ] || [ $code -eq 137 ] || fail "bake $i of 8 ended with $code: $(cat err$i)"
  done
  for b in b0 b1 b2 b3; do
    if [ -e $b ]; then expect_same whole $b; fi
    expect 0 organbake bake r.yaml -o $b --quiet
    expect_same whole $b
  done
  expect_equal "$(leftovers "$WORK")" ""
done
