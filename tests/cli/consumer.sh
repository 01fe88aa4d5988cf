#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Another program finds the installed player, builds against it and pokes a baked organ.
source "$(dirname "$0")/assert.sh"

expect 0 cmake --install "$BIN/.." --component liborganplay-dev --prefix "$WORK/prefix"
expect 0 cmake --install "$BIN/.." --component organplay --prefix "$WORK/prefix"
[ -x prefix/bin/organplay ] || fail "organplay was not installed"
expect 0 cmake -S "$SOURCE/tests/consumer" -B build -G Ninja -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_PREFIX_PATH="$WORK/prefix"
expect 0 cmake --build build

small_recipe >recipe.yaml
expect 0 organbake bake recipe.yaml -o organ
expect 0 build/poke_organ organ poked.ppm
# The tissue resists: some force, and not that of a wall.
awk '{ exit !($1 > 0.01 && $1 < 1000) }' out || fail "a force of $(cat out) N"
# The organ is in the picture: not one colour all over.
[ "$(tail -c +16 poked.ppm | od -An -v -tx1 -w3 | sort -u | wc -l)" -gt 50 ] || fail "an empty picture"
cp poked.ppm first.ppm
expect 0 build/poke_organ organ poked.ppm
expect_same first.ppm poked.ppm
expect 1 build/poke_organ nowhere poked.ppm
expect_err "nowhere"

# A solver of the program's own drives the organ: it is pressed in, some millimetres.
expect 0 build/drive_organ organ driven.ppm
awk '{ exit !($1 > 0.001 && $1 < 1000 && $9 > 0.5 && $9 < 40) }' out || fail "driven: $(cat out)"
cmp -s driven.ppm poked.ppm && fail "the driven organ looks like the poked one"
cp driven.ppm first.ppm
expect 0 build/drive_organ organ driven.ppm
expect_same first.ppm driven.ppm
expect 1 build/drive_organ nowhere driven.ppm
expect_err "nowhere"
