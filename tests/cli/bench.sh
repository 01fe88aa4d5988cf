#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# organbench: a quick run tells its figures and is a valid document; diff; wrong calls.
source "$(dirname "$0")/assert.sh"
organbench() { "$BIN/organbench" "$@"; }

expect 0 organbench --help
expect_out "decimate"
expect 2 organbench
expect_err "-o DIR"
expect 2 organbench decimat -o run
expect_err "did you mean 'decimate'"
expect 73 organbench -o /dev/null/x

expect 0 organbench --quick --rounds 1 isosurface stereo -o run
expect_out "reached: depth off by more than 5 %, called ok, of 34: 0"
expect 0 organbake verify run/organbench.json
grep -q '"failure": ""' run/organbench.json || fail "the suite ended early"

expect 0 organbench diff run run
expect_out "same"
sed 's/"median": \([0-9.]*\)/"median": 9\1/; s/"least": \([0-9.]*\)/"least": 9\1/; s/"most": \([0-9.]*\)/"most": 9\1/' \
  run/organbench.json >slow.json
expect 3 organbench diff run slow.json
expect_out "WORSE"
expect 66 organbench diff run nowhere
echo '{"schema": "organbake/bench/1"}' >bad.json
expect 65 organbench diff run bad.json
expect_err "bad.json"

# Ctrl-C keeps what was found until then.
set -m
"$BIN/organbench" isosurface -o stopped >/dev/null 2>err &
victim=$!
while kill -0 $victim 2>/dev/null && ! grep -q '^organbench: isosurface: ' err; do sleep 0.02; done
kill -INT $victim
wait $victim
expect_equal $? 130
expect 0 organbake verify stopped/organbench.json
grep -q '"failure": "stopped"' stopped/organbench.json || fail "it is not said that it was stopped"
