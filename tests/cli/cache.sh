#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bake runs what has changed, and nothing else.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml

# Runs a bake and prints the stages that ran.
ran() {
  organbake bake r.yaml -o b --json "$@" 2>err |
    python3 -c 'import json, sys; print(*[s["stage"] for s in json.load(sys.stdin)["stages"] if s["state"] == "ran"])'
}
expect_ran() { expect_equal "$(ran "${@:2}")" "$1"; }

expect_ran "phantom isosurface decimate mechanics place capture"
checksums b >cold
expect_ran ""
expect_err "b: unchanged; 0 of 6 stages ran"
expect_ran "decimate mechanics capture" --set decimate.faces=50
expect_ran "isosurface decimate mechanics place capture" --set isosurface.iso=-100
expect_ran "phantom isosurface decimate mechanics place capture" --force
checksums b >forced
expect_same cold forced

expect 0 organbake bake r.yaml --dry-run --set decimate.faces=55
expect_out "isosurface: cached"
expect_out "decimate: to run"
expect_out "place: cached"
expect_gone made
expect 0 organbake bake r.yaml --dry-run --explain --set decimate.faces=55
expect_out "decimate: to run, because faces was"
expect_out "mechanics: to run, because its proxy is made anew"
expect_out "input    surface"

# A warm bake needs no stage's libraries.
LD_DEBUG=files organbake bake r.yaml -o b 2>loaded >/dev/null
grep -q "stage_.*\.so" loaded && fail "a warm bake loads a module"
grep -q "vtk" loaded && fail "a warm bake loads VTK"

# What the scene does not need is left out, and said.
small_phantom p
expect 0 organbake bake r.yaml -o b2 --verbose --set ct=p/ct.mha
expect_err "phantom: left out, the ct is given"
expect_err "colour from photographs, none are given"
expect 0 organbake bake r.yaml -o b2 --verbose --set surface=p/truth.ply
expect_err "isosurface: left out, the surface is given"
expect_err "the surface has colours of its own"

# Only as far as asked for.
expect 0 organbake bake r.yaml -o only.ply --to isosurface
expect 0 organbake inspect only.ply
expect_out "closed_manifold         true"

# A damaged cache is noticed and mended; so is a damaged bundle.
for file in "$ORGANBAKE_CACHE"/*/proxy.ply; do
  printf 'X' | dd of="$file" bs=1 seek=300 conv=notrunc status=none
done
rm -rf b
expect 0 organbake bake r.yaml -o b
expect_err "damaged"
checksums b >mended
expect_same cold mended
printf 'X' | dd of=b/proxy.ply bs=1 seek=300 conv=notrunc status=none
expect 0 organbake bake r.yaml -o b
checksums b >mended
expect_same cold mended
expect_equal "$(leftovers "$WORK")" ""

# Several bakes may share a cache.
rm -rf "$ORGANBAKE_CACHE"
for i in 1 2 3; do organbake bake r.yaml -o c$i --quiet >/dev/null & done
wait
for i in 1 2 3; do checksums c$i >shared; expect_same cold shared; done

# What another program made does not count, whether in a stage's module or in one that stages share.
mkdir -p own/bin own/lib
cp -L "$BIN/organbake" own/bin && cp -rL "$BIN/../lib/organbake" own/lib
BIN=$WORK/own/bin
expect_ran ""
echo >>own/lib/organbake/stage_place.so
expect_ran "place"
echo >>own/lib/organbake/organbake_contouring.so
# Which later steps saw it loaded hangs on which of the bakes above made them.
[[ $(ran) == isosurface* ]] || fail "an isosurface by another contour counts"
expect_ran ""
