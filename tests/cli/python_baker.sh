#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The module organbake of Debian's python3, against the program and against known shapes.
source "$(dirname "$0")/assert.sh"
module=$BIN/../python
ls "$module"/organbake*.so >/dev/null 2>&1 || { echo "SKIPPED: the Python module was not built"; exit 0; }
export PYTHONPATH=$module PYTHONDONTWRITEBYTECODE=1
expect 0 organbake phantom -o phantom --photos 1 --photo-size-px 320 --size-voxels 64,64,32 --spacing-mm 4,4,6 \
  --truth-subdivisions 5 --quiet
expect 0 organbake decimate phantom/truth.ply -o proxy.ply --faces 80 --json
cp "$WORK/out" decimate.json
expect 0 organbake place phantom/truth.ply -o cameras --count 6 --size-px 128 --quiet
expect 0 organbake register phantom/truth.ply phantom/photos/photo_00.png \
  --intrinsics phantom/photos/cameras.json --init phantom/photos/cameras.json -o pose.json --quiet
/usr/bin/python3 "$SOURCE/tests/cli/python_baker.py" . || fail "the module's own tests"
