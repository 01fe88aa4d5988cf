#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The bill of materials holds SPDX's rules, names what the loader loads, and comes out the same twice.
source "$(dirname "$0")/assert.sh"
command -v dpkg-query readelf ninja >/dev/null || { echo "SKIPPED: no Debian packages here"; exit 0; }
expect 0 "$SOURCE/scripts/sbom" "$BIN/.." -o one.json
expect 0 python3 "$SOURCE/tests/cli/check_sbom.py" one.json \
  "$BIN/organbake" "$BIN/organplay" "$BIN/../lib/organbake/stage_isosurface.so"
[ -s out ] && [ "$(cat out)" != "" ] && cat out
expect 0 "$SOURCE/scripts/sbom" "$BIN/.." -o two.json
expect_same one.json two.json
# Where there is no build it says so, and writes nothing.
mkdir empty
expect 1 "$SOURCE/scripts/sbom" empty -o made.json
expect_err "holds no programs"
expect_gone made.json
