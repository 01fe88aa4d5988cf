#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A video of random pokes, with depth and masks beside it: poke_video.py BUNDLE FOLDER [SEED]"""
import pathlib
import subprocess
import sys

import numpy as np
import organplay

if "--help" in sys.argv or "-h" in sys.argv:
    sys.exit(print(__doc__.strip()))
if len(sys.argv) < 3:
    sys.exit(__doc__.splitlines()[0])
bundle, folder = sys.argv[1], pathlib.Path(sys.argv[2])
random = np.random.default_rng(int(sys.argv[3]) if len(sys.argv) > 3 else 0)
folder.mkdir(parents=True, exist_ok=True)
player = organplay.Player(bundle)
view = player.orbit(width=640, height=480)
towards_eye = -view.camera_from_world[2, :3]
video = subprocess.Popen(
    ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "640x480",
     "-r", "60", "-i", "-", "-pix_fmt", "yuv420p", str(folder / "pokes.mp4")],
    stdin=subprocess.PIPE)
for poke in range(4):
    direction = towards_eye + 0.6 * random.normal(size=3)
    direction /= np.linalg.norm(direction)
    skin, depth = np.array(player.skin_point(direction)), random.uniform(5, 15)
    for i in range(60):  # a second in and out
        below = depth * np.sin(np.pi * i / 60) - 2
        step = player.step([skin + (5 - below) * direction])
        picture = player.draw(view, "depth,mask")
        video.stdin.write(picture.rgb.tobytes())
    np.savez(folder / f"poke_{poke}.npz", depth_mm=picture.depth_mm, mask=picture.mask,
             force_n=step.forces_n)
video.stdin.close()
sys.exit(video.wait())
