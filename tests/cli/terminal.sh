#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The result on stdout, all else on stderr: a bar on a terminal, plain lines elsewhere, colours only
# where they are wanted.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
escape=$(printf '\033')

on_terminal() {  # what a terminal gets to see
  env -u NO_COLOR "$@" python3 - "$BIN/organbake" bake r.yaml -o b --force <<'END'
import os, pty, sys
pty.spawn(sys.argv[1:], lambda fd: os.read(fd, 4096))
END
}
expect 0 organbake bake r.yaml -o b
expect_equal "$(cat out)" b
grep -q "$escape" err && fail "control characters in a plain log"
expect_err "decimate: ran in"
expect 0 organbake bake r.yaml -o b --quiet --force
expect_equal "$(grep -v '^warning: ' err)" ""
expect 0 organbake bake r.yaml -o b --json
python3 -c 'import json; assert json.load(open("out"))["state"] == "unchanged"' || fail "--json"

on_terminal TERM=xterm >seen
grep -q '\[#* *\] [0-9]* %' seen || fail "no bar on a terminal"
# The end tells what was made, in what time, and what comes next; what was skipped is for --verbose.
expect 0 organbake bake r.yaml -o b --force
tail -n 1 err | grep -qE '^b: .*; 6 of 6 stages ran; [0-9.]+ s. To play it: organplay b$' ||
  fail "the last line: $(tail -n 1 err)"
grep -q 'skipped: ' err && fail "what was skipped is told without --verbose"
expect 0 organbake bake r.yaml -o b --force --verbose
expect_err "place: skipped: "

# From its second second on a task tells its time, and what is left: one that was held up for three.
python3 - "$BIN/organbake" bake r.yaml -o b --force <<'END' >seen || fail "a bake that was held up"
import os, pty, signal, sys, time
pid, screen = pty.fork()
if pid == 0:
    os.environ["TERM"] = "xterm"
    os.execv(sys.argv[1], sys.argv[1:])
held = False
while True:
    try:
        text = os.read(screen, 4096)
    except OSError:
        break
    if not text:
        break
    sys.stdout.buffer.write(text)
    if b"phantom [" in text and not held:
        held = True
        os.kill(pid, signal.SIGSTOP)
        time.sleep(3)
        os.kill(pid, signal.SIGCONT)
sys.exit(os.waitpid(pid, 0)[1] != 0)
END
grep -qE 'phantom \[#* *\] [0-9]+ %, (about )?[0-9]+ s' seen || fail "no time on a terminal"
on_terminal TERM=dumb >seen
grep -q "$escape" seen && fail "control characters on a dumb terminal"
# An error is red on a terminal, and plain under NO_COLOR.
fails() {
  env -u NO_COLOR TERM=xterm "$@" python3 -c \
    'import pty, sys; pty.spawn(sys.argv[1:], lambda fd: __import__("os").read(fd, 4096))' \
    "$BIN/organbake" decimate missing.ply -o x.ply </dev/null
}
fails >seen
grep -q "${escape}\[31morganbake: error" seen || fail "no colour on a terminal"
fails NO_COLOR=1 >seen
grep -q "${escape}\[31m" seen && fail "a colour in spite of NO_COLOR"
true
