#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Tissue that breathes while the scope moves: the script of the clip's bundle moves its proxy as the
# phantom moved its tissue.
source "$(dirname "$0")/assert.sh"

expect 0 organbake phantom --kind laparoscopy --frame-width-px 400 --frame-height-px 300 --path slide \
  --frames 75 --no-instrument --breathing-mm 6 --breathing-period-s 1 -o breathing
expect 0 organbake bake "$SOURCE/pipelines/recipes/laparoscopy.yaml" --quality draft --set frames=breathing/frames \
  --set intrinsics=breathing/cameras.json --set motion.key_frames=4 -o breath
expect_err "with --script breath/breath.json"
expect 0 organbake verify breath/breath.json
expect 0 "$BIN/organplay" breath --script breath/breath.json --size 160x120 --out breaths
[ "$(ls breaths/*.png | wc -l)" = 25 ] || fail "one breath is not 25 frames"
cmp -s breaths/frame_0000.png breaths/frame_0012.png && fail "nothing moves"
/usr/bin/python3 - <<'END' || fail "the proxy does not breathe as the phantom"
import csv, json
import numpy as np
stages = {s["stage"]: s["figures"] for s in json.load(open("breath/report.json"))["stages"]}
# The world is the camera of the middle key frame, as large as told.
keys = stages["motion"]["key_frame"]
pose = json.load(open("breathing/cameras.json"))["cameras"][int(keys[len(keys) // 2])]["camera_from_world"]
turn, shift = np.array(pose["rotation"], float).reshape(3, 3), np.array(pose["translation_mm"], float)
def vertices(path, rest_of_vertex):
    ply = open(path, "rb").read()
    begin = ply.index(b"end_header\n") + 11
    count = int(ply[:begin].split(b"element vertex ")[1].split()[0])
    return np.frombuffer(ply, [("xyz", "<f8", 3), ("rest", "u1", rest_of_vertex)], count, begin)["xyz"]
rest, true = vertices("breath/proxy.ply", 0), vertices("breathing/truth/surface.ply", 12)
true = true @ turn.T + shift
true = true[true[:, 2] > 1]
across = lambda v: v[:, :2] / v[:, 2:]
nearest = [np.argmin(((across(true) - ray) ** 2).sum(1)) for ray in across(rest)]
scale = np.median(rest[:, 2] / true[nearest, 2])
y = ((rest / scale - shift) @ turn)[:, 1]
t = np.clip((y + 40) / 90, 0, 1)  # the liver is pushed more than what lies beside it
push = np.outer(1 - 0.65 * t * t * (3 - 2 * t), [0, 0.8, -0.6])
states = np.array(json.load(open("breath/breath.json"))["vertices_mm"]).reshape(25, -1, 3)
breath = [float(row["breath_mm"]) for row in csv.DictReader(open("breathing/truth/frames.csv"))]
off = [np.linalg.norm((state - rest) / scale @ turn - mm * push, axis=1) for state, mm in zip(states, breath)]
print("scale", scale, "off", np.sqrt(np.mean(np.square(off))), np.percentile(off, 95), "mm; at most", stages["capture"]["breath_mm"])
# What all tissue does alike is the scope's in part, and how much of it a draft of small frames gives
# to the scope differs from clip to clip: 0.28 to 1.24 mm for four seeds and two looks of the tissue,
# 0.56 to 2.5 in the worst twentieth. Tissue that stood still would be 2.3 off, the wrong way 4.6.
kOff_mm, kWorst_mm = 1.5, 3  # of 6
assert np.sqrt(np.mean(np.square(off))) < kOff_mm, off
assert np.percentile(off, 95) < kWorst_mm, off
END
