#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The package organplay for Debian's python3, and its examples.
source "$(dirname "$0")/assert.sh"
module=$BIN/../python
ls "$module"/organplay/_organplay*.so >/dev/null 2>&1 || { echo "SKIPPED: the Python module was not built"; exit 0; }
export PYTHONPATH=$module PYTHONDONTWRITEBYTECODE=1
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet --set mechanics.fem_cell_mm=8
/usr/bin/python3 "$SOURCE/tests/cli/python_module.py" b "$BIN/organplay" || fail "the module's own tests"
/usr/bin/python3 "$SOURCE/tests/cli/python_pictures.py" b "$BIN/organplay" || fail "the tests of pictures"
/usr/bin/python3 "$SOURCE/tests/cli/python_gym.py" b || fail "the tests of organplay.gym"
/usr/bin/python3 "$SOURCE/tests/cli/python_lerobot.py" b || fail "the tests of organplay.lerobot"
expect 0 /usr/bin/python3 "$SOURCE/apps/python/examples/poke_video.py" b video 3
[ -s video/pokes.mp4 ] && [ -s video/poke_3.npz ] || fail "the example wrote no video"

# A solver of the caller's own drives the organ, and its recording is played.
example=$SOURCE/apps/python/examples
expect 0 /usr/bin/python3 "$example/numpy_solver.py" b trajectory.npz 12
expect_out "the farthest moved"
expect 0 /usr/bin/python3 "$example/play_trajectory.py" b trajectory.npz played
expect_out "12 pictures"
[ -s played/trajectory.mp4 ] && [ -s played/layers.npz ] || fail "no picture of the trajectory"

# The chapter's loop learns, and is the one that is printed there.
expect 0 /usr/bin/python3 "$example/train_press.py" b curve.svg
expect_out "round 11"
grep -q "<polyline" curve.svg || fail "no learning curve"
PATH="$BIN:$PATH" expect 0 /usr/bin/python3 -m organplay b -o from_module.png --size 64x48 --quiet
expect 0 "$BIN/organplay" b -o from_program.png --size 64x48 --quiet
expect_same from_module.png from_program.png
