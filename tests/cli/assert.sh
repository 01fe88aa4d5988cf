# SPDX-License-Identifier: GPL-3.0-or-later
# Sourced by every test of this folder: <test>.sh BIN_FOLDER. Each runs in a folder of its own, with
# a cache of its own, and fails when any expectation failed.
set -u
export LC_ALL=C NO_COLOR=1
BIN=$(cd "$1" && pwd)
SOURCE=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
WORK=$(mktemp -d "${TMPDIR:-/tmp}/organbake-cli-XXXXXX")
export ORGANBAKE_CACHE=$WORK/cache XDG_CONFIG_HOME=$WORK/config
cd "$WORK" || exit 1
failures=0

organbake() { "$BIN/organbake" "$@"; }
fail() { echo "FAILED (line ${BASH_LINENO[1]}): $*"; failures=$((failures + 1)); }
finish() {
  local code=$?
  cd / && rm -rf "$WORK"
  [ $failures -eq 0 ] && [ $code -eq 0 ] && exit 0
  echo "$failures expectation(s) failed, last exit code $code"
  exit 1
}
trap finish EXIT

# expect CODE COMMAND…: its exit code; what it says is kept in the files out and err.
expect() {
  local wanted=$1 code=0
  shift
  "$@" >"$WORK/out" 2>"$WORK/err" || code=$?
  [ $code -eq "$wanted" ] || fail "exit code $code, not $wanted: $* -- $(tail -n 3 "$WORK/err")"
}
expect_err() { grep -qF -- "$1" "$WORK/err" || fail "stderr lacks '$1': $(tail -n 3 "$WORK/err")"; }
expect_out() { grep -qF -- "$1" "$WORK/out" || fail "stdout lacks '$1': $(tail -n 3 "$WORK/out")"; }
# One clear sentence, besides what stages warned of: no second line, no trace of a programmer's world.
expect_sentence() {
  [ "$(grep -vc '^warning: ' "$WORK/err")" -eq 1 ] || fail "not one line: $(cat "$WORK/err")"
}
expect_same() { diff -r "$1" "$2" >/dev/null || fail "$1 and $2 differ: $(diff -rq "$1" "$2")"; }
expect_gone() { [ ! -e "$1" ] || fail "$1 was left behind"; }
expect_equal() { [ "$1" = "$2" ] || fail "'$1' is not '$2'"; }
# Hidden temporary files of ours below a folder.
leftovers() { find "$1" -name '*.tmp-*' 2>/dev/null; }
checksums() { (cd "$1" && find . -type f | sort | xargs sha256sum); }

# The documented code, one clear sentence, and nothing left behind at "made".
refused() {  # CODE TEXT COMMAND…
  local code=$1 text=$2
  shift 2
  expect "$code" "$@" --quiet
  expect_err "$text"
  expect_sentence
  expect_gone made
}

# A phantom that bakes in a fraction of a second, and a recipe for it.
small_phantom() {
  expect 0 organbake phantom -o "$1" --size-voxels 40,40,16 --photos 3 --photo-size-px 96 \
    --truth-subdivisions 3
}
milliseconds() { date +%s%3N; }
sleep_ms() { sleep "$(($1 / 1000)).$(printf %03d $(($1 % 1000)))"; }
small_recipe() {
  cat <<END
schema: organbake/recipe/1
name: small
phantom: {size_voxels: [40, 40, 16], photos: 3, photo_size_px: 96, truth_subdivisions: 3}
decimate: {faces: 60}
place: {count: 4, size_px: 48}
END
}
# The same, where the decimation's quality is not the question.
quick_recipe() { small_recipe | sed 's/faces: 60/faces: 60, method: quadric/'; }
