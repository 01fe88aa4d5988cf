#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A solver of one's own moves a baked organ: numpy_solver.py BUNDLE TRAJECTORY.npz [STEPS]

Position-based dynamics (Müller et al. 2007) on the bundle's tetrahedra: edges keep their lengths,
all side by side, and a ball pushes nodes out of itself. The bundle tells the mesh; set_nodes()
shows what comes of it. The nodes of every step go into an .npz that play_trajectory.py shows.
"""
import sys

import numpy as np
import organplay

EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]


class PositionBased:
    def __init__(self, mesh, time_step_s=1 / 60, iterations=20):
        corners = np.sort(np.vstack([mesh.tetrahedra[:, pair] for pair in EDGES]), axis=1)
        self.a, self.b = np.unique(corners, axis=0).T
        self.x = mesh.nodes_mm.copy()
        self.velocity = np.zeros_like(self.x)
        self.inverse_mass = 1 / mesh.node_mass_kg
        self.inverse_mass[mesh.node_anchors] = 0
        self.length_mm = np.linalg.norm(self.x[self.b] - self.x[self.a], axis=1)
        ends = np.concatenate([self.a, self.b])
        self.edges_at = np.maximum(1, np.bincount(ends, minlength=len(self.x)))[:, None]
        self.time_step_s, self.iterations = time_step_s, iterations

    def keep_lengths(self):
        along = self.x[self.b] - self.x[self.a]
        length = np.linalg.norm(along, axis=1)
        weights = self.inverse_mass[self.a] + self.inverse_mass[self.b]
        pull = ((length - self.length_mm) / np.maximum(1e-9, length * weights))[:, None] * along
        for ends, sign in ((self.a, 1), (self.b, -1)):
            for k in range(3):  # each node goes by the mean of what its edges ask
                moved = np.bincount(ends, pull[:, k], minlength=len(self.x)) * self.inverse_mass
                self.x[:, k] += sign * moved / self.edges_at[:, 0]

    def keep_out(self, tip_mm, radius_mm):
        away = self.x - tip_mm
        distance = np.linalg.norm(away, axis=1)
        inside = (distance < radius_mm) & (self.inverse_mass > 0)
        self.x[inside] = tip_mm + radius_mm / distance[inside, None] * away[inside]

    def step(self, tip_mm, radius_mm):
        before = self.x.copy()
        self.x += 0.9 * self.time_step_s * self.velocity  # a tenth is lost to damping
        for _ in range(self.iterations):
            self.keep_lengths()
            self.keep_out(tip_mm, radius_mm)
        self.velocity = (self.x - before) / self.time_step_s


def main(bundle, trajectory, steps=60):
    player = organplay.Player(bundle)
    solver = PositionBased(player.mesh())
    view = player.orbit(width=320, height=240)
    out = -view.camera_from_world[2, :3]
    skin, radius_mm, nodes = np.array(player.skin_point(out)), 12.0, []
    for i in range(steps):
        tip_mm = skin + (radius_mm + 8 - 25 * i / steps) * out
        solver.step(tip_mm, radius_mm)
        player.set_nodes(solver.x)
        player.place_tools([tip_mm], radius_mm=radius_mm)
        picture = player.draw(view, "depth")
        nodes.append(solver.x.copy())
    np.savez(trajectory, nodes_mm=nodes, time_step_s=solver.time_step_s)
    moved = np.linalg.norm(nodes[-1] - player.mesh().nodes_mm, axis=1).max()
    print(f"{steps} steps of {len(solver.x)} nodes; the farthest moved {moved:.1f} mm; "
          f"nearest skin {picture.depth_mm.min():.1f} mm")


if __name__ == "__main__":
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.exit(print(__doc__.strip()))
    if len(sys.argv) < 3:
        sys.exit(__doc__.splitlines()[0])
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 60)
