#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds that no precompiled header takes a flag away from the commands that use it.

GCC restores the options that a header was made with where that header holds `#pragma GCC
push_options`, as Eigen's does through immintrin.h: -frounding-math, -ffp-contract or -O1 of a
command are then lost without a word. A probe whose code each of these flags changes is compiled as
every such command says, once with its header and once without: its code must be the same.
usage: flags_in_force.py COMPILE_COMMANDS_JSON
"""
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import tempfile

PROBE = """extern "C" {
double third() { return 1.0 / 3.0; }
double fused(double a, double b, double c) { return a * b + c; }
double root(double x) { return __builtin_sqrt(x); }
void nearer(float* x, const float* y) {
  for (int i = 0; i < 64; ++i) x[i] = y[i] < x[i] ? 2 * y[i] : x[i] / 3;
}
}
"""
# What the probe must show: its code differs from that of -O3 alone.
SHOWN = ["-frounding-math", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-O1", "-O0"]


class Command:
    """A compiler's call without its source and outputs, and the header that it names first."""

    def __init__(self, entry):
        words = shlex.split(entry["command"])
        while not re.fullmatch(r"(.*/)?[^/]*(g\+\+|c\+\+|gcc|cc)(-\d+)?", words[0]):
            words.pop(0)  # what starts the compiler
        self.output, self.header, self.words = entry["file"], [], []
        while words:
            word = words.pop(0)
            if word == "-include":
                self.header = [word, words.pop(0)]
            elif word in ("-o", "-MT", "-MF", "-c"):
                following = words.pop(0)
                self.output = following if word == "-o" else self.output
            elif word != "-MD":
                self.words.append(word)

    def uses_header(self):
        return bool(self.header) and "c++-header" not in self.words

    def flags(self):
        """What makes code: commands that agree in it, and in the header, need one probe."""
        return " ".join(word for word in self.words if re.match(r"-[Ofmg]", word))


def code(words, probe):
    """The instructions of the probe's functions; a header may bring functions of its own."""
    run = subprocess.run(words + ["-g0", "-Werror=invalid-pch", "-S", "-o", "-", probe], capture_output=True, text=True)
    if run.returncode:
        sys.exit(f"flags_in_force: {shlex.join(words)}\n{run.stderr}")
    functions = re.findall(r"^(?:third|fused|root|nearer):$.*?^\s*\.size", run.stdout, re.MULTILINE | re.DOTALL)
    return re.sub(r"\.(L[A-Za-z_]*)\d+", r".\1", "\n".join(functions))


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        commands = [Command(entry) for entry in json.load(file) if entry["file"].endswith(("cpp", "cxx"))]
    commands = {(c.header[1], c.flags()): c for c in commands if c.uses_header()}.values()
    if not commands:
        print("SKIPPED: no command uses a precompiled header")
        return
    faults = []
    with tempfile.NamedTemporaryFile("w", suffix=".cpp") as probe:
        probe.write(PROBE)
        probe.flush()
        fusing = "-march=x86-64-v3" if platform.machine() == "x86_64" else "-march=armv8-a"
        plain = [next(iter(commands)).words[0], fusing, "-O3"]
        for flag in SHOWN:
            if code(plain + [flag], probe.name) == code(plain, probe.name):
                faults.append(f"the probe does not show {flag}")
        for command in commands:
            if not os.path.exists(command.header[1] + ".gch"):
                faults.append(f"{command.header[1]}.gch is not there: build {command.output} first")
            elif code(command.words + command.header, probe.name) != code(command.words, probe.name):
                faults.append(f"{command.output}: {command.header[1]} takes some of its flags away: {command.flags()}")
    if faults:
        sys.exit("flags_in_force:\n" + "\n".join(faults))
    print(f"flags_in_force: {len(commands)} sets of flags with a header, all in force")


main()
