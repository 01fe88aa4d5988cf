#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The window, used by a mouse and a keyboard: a poke, overlays, pictures, a saved interaction that
# plays back to the same picture; undo; leaving; the start page; no display, no window.
source "$(dirname "$0")/assert.sh"
if [ ! -e "$BIN/../lib/organbake/organplay_window.so" ]; then
  echo "SKIPPED: organplay was built without its window"
  exit 0
fi
small_phantom p
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o b

unset DISPLAY WAYLAND_DISPLAY
expect 2 "$BIN/organplay" b
expect_err "no display"
expect_err "--script"
expect_sentence

for tool in Xvfb xdotool; do
  command -v $tool >/dev/null || { echo "SKIPPED: $tool is not installed"; exit 0; }
done
# Xvfb takes the first free display and tells it. Without -noreset it starts anew whenever its last
# window closes, and refuses whoever opens one meanwhile.
Xvfb -displayfd 3 -noreset -screen 0 800x600x24 3>display 2>/dev/null &
server=$!
trap 'kill $server $player 2>/dev/null; finish' EXIT
for _ in $(seq 300); do [ -s display ] && break; sleep 0.1; done
export DISPLAY=:$(cat display)

open_window() { # ARGUMENTS…
  "$BIN/organplay" "$@" --size 800x600 >said 2>err &
  player=$!
  window=
  for _ in $(seq 300); do
    window=$(xdotool search --onlyvisible --name '^organplay$' 2>/dev/null | head -n 1)
    [ -n "$window" ] && break
    kill -0 $player 2>/dev/null || break
    sleep 0.1
  done
  [ -n "$window" ] || fail "no window: $(cat err)"
  sleep 2
  xdotool windowfocus "$window"
}
press() { xdotool keydown "$1"; sleep 0.15; xdotool keyup "$1"; sleep 0.3; } # as long as a finger does
appears() { for _ in $(seq 300); do [ -s "$1" ] && return; sleep 0.1; done; fail "no $1"; }
quits() { # KEY…
  for key in "$@"; do press "$key"; done
  for _ in $(seq 300); do kill -0 $player 2>/dev/null || break; sleep 0.1; done
  kill $player 2>/dev/null && fail "organplay does not end"
  wait $player || fail "organplay ended with $?: $(cat err)"
}

open_window b
press p
appears frame_001.png
xdotool mousemove 400 270 mousedown 1
for _ in 1 2 3 4 5 6 7 8; do xdotool mousemove_relative -- 3 4; sleep 0.05; done
sleep 0.3
press space # time stands still, the tool is held
press p
appears frame_002.png
cmp -s frame_001.png frame_002.png && fail "the poke changed nothing"
press s
appears interaction_001.json
xdotool mouseup 1
for key in 1 2 3 w; do press $key; done
appears window_001.png
press z # the touch is undone, and the organ as it was
press p
appears frame_003.png
cmp -s frame_001.png frame_003.png || fail "undo leaves a trace"
press Escape
press Escape # asked, and stayed
press r
kill -0 $player || fail "Escape leaves at once"
quits Escape Return
expect_equal "$(sort said | tr '\n' ' ')" \
  "./frame_001.png ./frame_002.png ./frame_003.png ./interaction_001.json ./window_001.png "

expect 0 organbake verify interaction_001.json
expect 0 "$BIN/organplay" b --script interaction_001.json --out frames
cmp "$(ls frames/*.png | tail -n 1)" frame_002.png || fail "the interaction plays back differently"

# Two eyes, which see the organ from two places; E shows one.
open_window b --side-by-side
press p
appears frame_004.png
press e
press p
appears frame_005.png
quits q
PYTHONPATH=$SOURCE/tests/cli python3 - <<'END' || fail "two eyes are not two pictures"
from read_png import png
width, _, _, _, both = png("frame_004.png")
left, right = ([row[3 * a:3 * b] for row in both] for a, b in ((0, width // 2), (width // 2, width)))
moved = sum(abs(a - b) for one, other in zip(left, right) for a, b in zip(one, other)) / len(both) / width
assert 0.5 < moved < 25, moved  # levels of 255
assert png("frame_005.png")[0] > width // 2 + 100
END

# A blade needs tetrahedra, and leaves its trace with them.
expect 0 organbake bake r.yaml -o cuttable --set mechanics.fem_cell_mm=8
for solver in springs fem; do
  open_window cuttable --solver $solver
  press p
  press c
  xdotool mousemove 340 270 mousedown 1
  for _ in 1 2 3 4 5 6 7 8; do xdotool mousemove_relative -- 12 0; sleep 0.1; done
  xdotool mouseup 1
  sleep 0.5
  press s
  quits q
done
expect_equal "$(grep -ho '"mode": "[a-z]*"' interaction_00[23].json | tr '\n' ' ')" \
  '"mode": "poke" "mode": "cut" '

open_window # the start page
xdotool type nowhere
press Return # there is no such folder: it says so, and stays
kill -0 $player || fail "the start page is gone: $(cat err)"
quits Escape Return
expect 66 "$BIN/organplay" nowhere
