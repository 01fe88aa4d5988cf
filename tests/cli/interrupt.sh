#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Ctrl-C (and SIGTERM, SIGHUP): the stage stops, exit code 130, nothing left behind.
source "$(dirname "$0")/assert.sh"
cat >r.yaml <<END
schema: organbake/recipe/1
phantom: {size_voxels: [128, 128, 64], photos: 8, photo_size_px: 512, truth_subdivisions: 6}
END
set -m  # a job of its own: a shell without job control has background jobs ignore SIGINT
for signal in INT TERM HUP; do
  rm -rf "$ORGANBAKE_CACHE"
  "$BIN/organbake" bake r.yaml -o b >out 2>err &
  victim=$!
  sleep 0.3
  kill -$signal $victim
  code=0
  wait $victim || code=$?
  expect_equal "$code" 130
  expect_err "interrupted"
  expect_gone b
  expect_equal "$(leftovers "$WORK")" ""
done
