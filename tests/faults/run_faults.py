#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets faults from outside befall a small bake, one system call after the other.

A bake is run once to count its calls, then once for each call that is to fail. However it fails, it
must end with a documented exit code and one sentence; the bundle is then absent, the old one or the
new one, never anything between; nothing temporary is left; and the same command goes through once
the fault is over. Exits 1 if that was broken, and tells how to repeat what broke it.
"""

import argparse
import filecmp
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

RECIPE = """schema: organbake/recipe/1
name: small
phantom: {size_voxels: [40, 40, 16], photos: 3, photo_size_px: 96, truth_subdivisions: 3}
decimate: {faces: 60, method: quadric}
place: {count: 4, size_px: 48}
"""

# Exit codes that each fault may end in besides 0 (README, "Exit codes").
CANNOT_WRITE, CANNOT_READ = {73}, {66, 74}
ENDS = {
    "ENOSPC": CANNOT_WRITE, "full": CANNOT_WRITE, "EDQUOT": CANNOT_WRITE, "EROFS": CANNOT_WRITE,
    "EIO": CANNOT_WRITE | CANNOT_READ, "dead": CANNOT_WRITE | CANNOT_READ,
    "EMFILE": CANNOT_WRITE | CANNOT_READ, "ENOMEM": {74, 75},
    "EINTR": CANNOT_WRITE | CANNOT_READ, "short": set(), "clock": set(), "kill": {-signal.SIGKILL},
}


def same(left, right):
    """Whether two folders hold the same files with the same bytes."""
    names = [sorted(p.relative_to(f) for p in f.rglob("*")) for f in (left, right)]
    return names[0] == names[1] and all(
        filecmp.cmp(left / n, right / n, shallow=False) for n in names[0] if (left / n).is_file())


class Bakes:
    """A folder in which the same bake is run again and again."""

    def __init__(self, program, library, folder):
        self.program, self.library, self.folder = program, library, folder
        (folder / "r.yaml").write_text(RECIPE)
        for name, more in (("old", ["--set", "decimate.faces=50"]), ("whole", [])):
            done = self.bake(name, "warm", more=more)
            if done.returncode != 0:
                sys.exit(f"faults: a bake fails without any fault: {done.stderr}")

    def bake(self, target, cache, fault=None, at=0, more=()):
        # In one thread the calls come in the same order each time.
        command = [self.program, "bake", "r.yaml", "-o", target, "--cache", cache, "--quiet",
                   "--threads", "1", *more]
        (self.folder / "tmp").mkdir(exist_ok=True)
        environment = {**os.environ, "TMPDIR": str(self.folder / "tmp"), "LC_ALL": "C",
                       "NO_COLOR": "1", "HOME": str(self.folder)}
        if fault:
            environment |= {"FAULT_KIND": fault, "FAULT_AT": str(at), "LD_PRELOAD": self.library,
                            "FAULT_LOG": str(self.folder / "calls")}
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True,
                              text=True, errors="replace", timeout=300)

    def clear(self, over):
        """Before a bake: from nothing, or from a full cache over an older bundle."""
        for name in ("b", "b_report.html", "cache", "tmp"):
            path = self.folder / name
            shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
        if over:
            shutil.copytree(self.folder / "warm", self.folder / "cache")
            shutil.copytree(self.folder / "old", self.folder / "b")

    def calls(self):
        return [line.split(" ", 2)[1:] for line in
                (self.folder / "calls").read_text(errors="replace").splitlines()]

    def leftovers(self):
        found = [p for p in self.folder.rglob("*.tmp-*")]
        return [str(p.relative_to(self.folder)) for p in found + list((self.folder / "tmp").glob("*"))]

    def count(self, fault, over):
        self.clear(over)
        done = self.bake("b", "cache", fault)
        if done.returncode != 0:
            sys.exit(done.returncode if done.returncode == 77 else f"faults: {done.stderr}")
        return len(self.calls())

    def wrong(self, fault, over, at):
        """What is wrong with how the bake ends when its call number `at` fails; '' for nothing."""
        self.clear(over)
        try:
            done = self.bake("b", "cache", fault, at)
        except subprocess.TimeoutExpired:
            return "does not end"
        call = self.calls()[at - 1] if len(self.calls()) >= at else ["none", ""]
        code, said = done.returncode, done.stderr
        told = f"{' '.join(call)}: exit code {code}, '{said.strip()}'"
        bundle = self.folder / "b"
        # libgcrypt, which FFmpeg brings along, ends any program where it cannot see whether the
        # machine is in FIPS mode: like a kill.
        ends_itself = code == -signal.SIGABRT and "in libgcrypt" in said
        if code != 0 and code not in ENDS[fault] and not ends_itself:
            return told
        # Besides warnings, and what a library says about the machine.
        ours = [line for line in said.splitlines() if not line.startswith(("warning: ", "libnuma: "))]
        if code > 0 and (len(ours) != 1 or not ours[0].startswith("organbake: ")):
            return told + ": not one sentence"
        if code == 0 and not bundle.exists():
            return told + ": there is no bundle"
        states = ["whole"] if code == 0 else ["whole", "old"] if over else ["whole"]
        if bundle.exists() and not any(same(bundle, self.folder / s) for s in states):
            return told + ": the bundle is a mixture"
        # Who is killed, or may not remove, cannot tidy up: the next bake does.
        helpless = (fault in ("kill", "dead", "EROFS") or ends_itself or
                    call[0] in ("unlink", "unlinkat", "rmdir"))
        if self.leftovers() and not helpless:
            return told + f": left behind {self.leftovers()}"
        again = self.bake("b", "cache")
        if again.returncode != 0 or not same(bundle, self.folder / "whole"):
            return told + f": the next bake ends with {again.returncode}, {again.stderr}"
        if self.leftovers():
            return told + f": left behind after the next bake {self.leftovers()}"
        return ""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", help="organbake")
    parser.add_argument("library", help="the library that is preloaded")
    parser.add_argument("--kinds", default=",".join(ENDS), help="faults, by commas")
    parser.add_argument("--sample", type=int, default=0, help="so many calls of each; 0: all")
    parser.add_argument("--seed", type=int, default=1, help="which")
    parser.add_argument("--at", type=int, default=0, help="this call alone")
    parser.add_argument("--over", choices=["yes", "no"], help="only over an old bundle, only anew")
    options = parser.parse_args()
    chance = random.Random(options.seed)
    broken = runs = 0
    with tempfile.TemporaryDirectory(prefix="organbake-faults-") as name:
        bakes = Bakes(os.path.abspath(options.program), os.path.abspath(options.library), Path(name))
        for fault in options.kinds.split(","):
            for over in (False, True):
                if options.over and over != (options.over == "yes"):
                    continue
                calls = range(1, bakes.count(fault, over) + 1)
                chosen = [options.at] if options.at else list(calls)
                if fault == "clock":
                    chosen = [1]
                elif options.sample and not options.at:
                    chosen = sorted(chance.sample(calls, min(options.sample, len(calls))))
                found = 0
                for at in chosen:
                    runs += 1
                    if why := bakes.wrong(fault, over, at):
                        found += 1
                        over_flag = "yes" if over else "no"
                        print(f"--kinds {fault} --over {over_flag} --at {at}: {why}", flush=True)
                broken += found
                print(f"{fault}{' over an old bundle' if over else ''}: {len(chosen)} of {len(calls)} "
                      f"calls, {found} ended wrongly", flush=True)
    print(f"faults: {runs} bakes, {broken} ended wrongly")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
