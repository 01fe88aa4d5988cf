#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The module organplay of Debian's python3, and its examples.
source "$(dirname "$0")/assert.sh"
module=$BIN/../python
ls "$module"/organplay*.so >/dev/null 2>&1 || { echo "SKIPPED: the Python module was not built"; exit 0; }
export PYTHONPATH=$module PYTHONDONTWRITEBYTECODE=1
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet --set mechanics.fem=true --set mechanics.fem_cell_mm=8
/usr/bin/python3 "$SOURCE/tests/cli/python_module.py" b "$BIN/organplay" || fail "the module's own tests"
expect 0 /usr/bin/python3 "$SOURCE/apps/python/examples/poke_video.py" b video 3
[ -s video/pokes.mp4 ] && [ -s video/poke_3.npz ] || fail "the example wrote no video"
