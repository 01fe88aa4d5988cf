#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What a user meets first: help, versions, and errors of usage.
source "$(dirname "$0")/assert.sh"

expect 0 organbake --help
commands='phantom shade stereo fuse isosurface decimate mechanics place register capture bake new batch plan report export recipes materials inspect verify
  schema doctor'
for command in $commands; do
  expect_out "  $command "
done
for command in $commands; do
  expect 0 organbake $command --help
  expect_out "organbake $command"
  expect_out "--threads N"
  expect_out "[0…4096; default 0]"
done
organbake decimate --help >out
expect_out "--faces X|auto"
expect_out "[4…10000000; default 80]"
expect_out "one of fitted, lindstrom-turk, quadric"
expect 0 organbake --version
expect_out "organbake "

# The clone's own scripts: help, and nothing else is done.
for script in "$SOURCE"/scripts/*; do
  [ -f "$script" ] && [ -x "$script" ] || continue
  expect 0 timeout 20 "$script" -h
  cp out short
  expect 0 timeout 20 "$script" --help
  expect_same short out
  expect_out "usage: scripts/$(basename "$script")"
done
expect 2 "$SOURCE/scripts/demo" --pakages .
expect_err "there is no option --pakages"
mkdir foreign && touch foreign/organ{bake,play}_9.9.9-1_m68k.deb
expect 66 "$SOURCE/scripts/demo" --packages foreign demo
expect_err "scripts/release makes them"
# The page's module of a release, into a clone that has no compiler for it.
mkdir -p clone/scripts release/web && cp "$SOURCE/scripts/build" clone/scripts && cp "$SOURCE/CMakeLists.txt" clone
version=$("$BIN/organbake" --version | sed -n 's/^organbake \([0-9.]*\).*/\1/p')
expect 66 clone/scripts/build web --packages release
expect_err "organbake-$version-web.tar.xz"
echo wasm >release/web/organ.wasm && tar -C release -cJf "release/organbake-$version-web.tar.xz" web
expect 0 clone/scripts/build web --packages release
expect_equal "$(cat clone/build/web/share/organbake/web/organ.wasm)" wasm

expect 2 organbake
expect 2 organbake bakke
expect_err "did you mean 'bake'?"
expect 2 organbake decimate x.ply -o y.ply --facs 80
expect_err "did you mean '--faces'?"
expect 2 organbake decimate x.ply -o y.ply --faces 3
expect_err "--faces: '3' is not possible; it takes auto or a number, 4…10000000"
expect 2 organbake decimate x.ply -o y.ply --faces
expect_err "its value is missing"
expect 2 organbake decimate x.ply
expect_err "-o is missing"
expect 2 organbake decimate -o y.ply
expect_err "lacks its input 'surface'"
expect 2 organbake decimate x.ply y.ply -o z.ply
expect 2 organbake --threads -1 doctor
expect 2 organbake schema recepi
expect_err "did you mean 'recipe'?"

# Three programs, one manner: what it is, how it is called, options in groups, the shared ones last.
shared=
organplay() { "$BIN/organplay" "$@"; }
organbench() { "$BIN/organbench" "$@"; }
for program in organbake organplay organbench; do
  expect 0 $program --help
  expect_out "usage: $program "
  [ "$(head -c ${#program} out)" = $program ] || fail "$program --help does not begin with its name"
  [ -z "$shared" ] && shared=$(sed -n '/^Shared options:/,$p' out)
  expect_equal "$(sed -n '/^Shared options:/,$p' out)" "$shared"
  expect 0 $program --version
  expect_out "$program "
  expect 0 $program --version --json
  expect_out "\"$program\": \""
  expect 2 $program --vrsion
  expect_err "unknown flag --vrsion; did you mean '--version'? (--help lists all)"
  expect 2 $program --threads many
  expect_err "--threads: 'many' is not possible; it takes a whole number, 0…4096"
done
expect 2 organplay b --light scop -o x.png
expect_err "--light: 'scop' is not possible; did you mean 'scope'? It takes one word, one of baked, world, scope"
expect 2 organplay b --script s.json --reference frames --threshold 30
expect_err "unknown flag --threshold; did you mean '--threshold-db'?"
# A setting that there was once is passed over with its value, and said.
expect 66 organbake capture x.ply p.ply c.json --zip-level 9 -o y
expect_err "zip_level is no longer a setting: it is always 6"

# Spellings of flags: value behind a blank or '=', switches with --no-, words after "--".
expect 66 organbake decimate --faces=80 --method lindstrom-turk x.ply -o y.ply
expect 66 organbake isosurface --no-cap --largest 0 -o y.ply -- -x.mha
expect_err "-x.mha: there is no such file"
expect 66 organbake --quiet --threads 1 isosurface x.mha -o y.ply
expect 2 organbake isosurface --cap=perhaps x.mha -o y.ply
expect 2 organbake isosurface --no-iso x.mha -o y.ply
expect 2 organbake place x.ply -o y --cone-axis 1,2
expect_err "three numbers (x,y,z)"

# The front program must start without the libraries that the stages need.
ldd "$BIN/organbake" >libraries
grep -E 'vtk|opencv|CGAL|embree|ceres|OpenMesh|gdcm' libraries && fail "a heavy library is linked"
true
