# SPDX-License-Identifier: Apache-2.0
"""An organ as a learner sees it, with Gymnasium's interface; it needs no package of that name.

An example, not a part of the module: the tip is to press one place of the skin as deep as asked.
"""
import numpy as np
import organplay


class OrganEnv:
    """Actions: (3,), how far the tip moves, -1 to 1 mm each. Observations: a dict of the picture
    (h, w, 3) uint8, the tip (3,) and the goal (3,), world mm."""

    def __init__(self, bundle, width=160, height=120, most_steps=200):
        self.player = organplay.Player(bundle)
        self.view = self.player.orbit(width=width, height=height)
        self.most_steps = most_steps
        self.random = np.random.default_rng()

    def reset(self, *, seed=None, options=None):
        if seed is not None:
            self.random = np.random.default_rng(seed)
        self.player.reset()
        outward = -self.view.camera_from_world[2, :3] + 0.2 * self.random.normal(size=3)
        outward /= np.linalg.norm(outward)
        skin = np.array(self.player.skin_point(outward))
        self.goal = skin - self.random.uniform(2, 8) * outward
        self.tip = skin + 20 * outward
        self.steps = 0
        return self._observe(), {}

    def step(self, action):
        action = np.clip(np.asarray(action, dtype=float), -1, 1)
        self.tip = self.tip + action
        done = self.player.step([self.tip])
        self.steps += 1
        away = float(np.linalg.norm(self.tip - self.goal))
        force = float(np.linalg.norm(done.forces_n[0]))
        reward = -0.01 * away - 0.1 * max(0.0, force - 2.0)
        return self._observe(), reward, away < 1, self.steps >= self.most_steps, {"force_n": force}

    def _observe(self):
        return {"picture": self.player.draw(self.view).rgb, "tip": self.tip, "goal": self.goal}
