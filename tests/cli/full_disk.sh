#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A full disk: exit code 73, one sentence, nothing left behind. A small tmpfs where this user may
# mount one; a limit on the size of files everywhere.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o whole --cache whole-cache

# In blocks of 1024 bytes; one at least, or the message could not be written either.
limited() { (ulimit -f "$1"; shift; "$BIN/organbake" "$@"); }
for blocks in 1 8 16; do
  rm -rf "$ORGANBAKE_CACHE"
  expect 73 limited $blocks bake r.yaml -o b --quiet
  expect_sentence
  expect_gone b
  expect_equal "$(leftovers "$WORK")" ""
done
# With the cache whole, it is the bundle that does not fit.
expect 73 limited 2 bake r.yaml -o b --quiet --cache whole-cache
expect_gone b
expect 73 limited 1 decimate whole/proxy.ply --faces 50 -o made.ply --quiet
expect_gone made.ply
expect_equal "$(leftovers "$WORK")" ""

mkdir disk
if mount -t tmpfs -o size=100k none disk 2>/dev/null; then
  trap 'umount "$WORK/disk"; finish' EXIT
  expect 73 organbake bake r.yaml -o disk/b --quiet --cache whole-cache
  expect_sentence
  expect_err "No space left"
  expect_equal "$(ls -A disk)" ""
  expect 73 organbake bake r.yaml -o b --quiet --cache disk/cache
  expect_sentence
  expect_err "No space left"
  expect_gone b
  expect_equal "$(find disk -type f)" ""
  # As soon as there is room again, the same command goes through.
  mount -o remount,size=50m disk
  expect 0 organbake bake r.yaml -o disk/b --quiet --cache disk/cache
  expect_same whole disk/b
else
  echo "no tmpfs can be mounted here: tried with a file size limit only"
fi
true
