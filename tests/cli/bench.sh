#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# organbench: a quick run tells its figures and is a valid document; wrong calls.
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
