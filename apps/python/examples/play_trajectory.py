#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The fine picture of a recorded coarse simulation: play_trajectory.py BUNDLE TRAJECTORY.npz FOLDER

The .npz holds nodes_mm (steps, nodes, 3), or vertices_mm (steps, vertices, 3), of the bundle's own
tetrahedra or proxy, world mm (LPS): any solver that was set up from Player.mesh(), or from
`organbake export --format gmsh` or mjcf, has them in that order. Writes trajectory.mp4 and, of each
step, depth, mask and flow into layers.npz.
"""
import pathlib
import subprocess
import sys

import numpy as np
import organplay

if "--help" in sys.argv or "-h" in sys.argv:
    sys.exit(print(__doc__.strip()))
if len(sys.argv) < 4:
    sys.exit(__doc__.splitlines()[0])
bundle, recorded, folder = sys.argv[1], np.load(sys.argv[2]), pathlib.Path(sys.argv[3])
folder.mkdir(parents=True, exist_ok=True)
of_nodes = "nodes_mm" in recorded
states = np.ascontiguousarray(recorded["nodes_mm" if of_nodes else "vertices_mm"])
player = organplay.Player(bundle)
view = player.orbit(0.3, 0.1, width=320, height=240)
pictures = player.draw_many(states, view, "depth,mask,flow", nodes=of_nodes)
np.savez_compressed(folder / "layers.npz", depth_mm=pictures.depth_mm, mask=pictures.mask,
                    flow_back=pictures.flow_back, flow_back_seen=pictures.flow_back_seen)
rate = 1 / float(recorded["time_step_s"]) if "time_step_s" in recorded else 60
video = subprocess.run(
    ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "320x240",
     "-r", str(rate), "-i", "-", "-pix_fmt", "yuv420p", str(folder / "trajectory.mp4")],
    input=pictures.rgb.tobytes(), check=True)
print(f"{len(states)} pictures, the largest flow {np.abs(pictures.flow_back).max():.1f} px")
