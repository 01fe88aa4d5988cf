# SPDX-License-Identifier: GPL-3.0-or-later
# usage: record_press.py BUNDLE SCRIPT OUT.npz: where the proxy's vertices lie at every frame of a
# script of one ball that goes straight, as the package organplay plays it.
import json
import sys

import numpy as np
import organplay

bundle, script, out = sys.argv[1], json.load(open(sys.argv[2])), sys.argv[3]
player = organplay.Player(bundle, solver=script["solver"], time_step_s=script["time_step_s"])
first, last = script["instruments"][0]["path"]
direction = np.array(first["direction"], float)
skin = np.array(player.skin_point(direction))
radius = json.load(open(f"{bundle}/mechanics.json"))["instrument_radius_mm"]
vertices = []
for frame in range(script["frames"]):
    share = min(1.0, frame * script["time_step_s"] / last["time_s"])
    depth = first["depth_mm"] + share * (last["depth_mm"] - first["depth_mm"])
    player.step([skin + (radius - depth) * direction], radius_mm=radius)
    vertices.append(player.proxy_mm())
np.savez(out, vertices_mm=vertices, time_step_s=script["time_step_s"])
