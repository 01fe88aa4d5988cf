#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A policy of three numbers learns to press an organ to a force: train_press.py BUNDLE CURVE.svg

By the cross-entropy method (Rubinstein 1999): in each round 16 policies of a normal distribution
play an episode each, and the best four are the next one. Takes about a minute for a liver.
"""
import sys

import numpy as np
from organplay.gym import OrganVectorEnv


def act(state, policies):  # (16, 16), (16, 3): of what is aside, what force is missing, how far the ball is above
    tip, out, missing = state[:, :3], state[:, 6:9], state[:, 12] - state[:, 13]
    height = (tip * out).sum(1)
    aside = tip - height[:, None] * out
    inwards = policies[:, 1] * missing + policies[:, 2] * np.maximum(height - 5, 0) / 20
    return np.clip(-policies[:, :1] * aside / 2 - inwards[:, None] * out, -1, 1)


def play(env, policies, seed, steps=70):  # what each policy gained, and whether it solved its task
    state, gain, done = env.reset(seed=seed)[0]["state"], np.zeros(16), np.zeros(16, bool)
    for _ in range(steps):
        observed, reward, ended, _, _ = env.step(act(state, policies) * ~done[:, None])
        state, gain = observed["state"], gain + reward * ~done
        done |= ended
    return gain, done


def main(bundle, curve, rounds=12):
    random, mean, spread, solved = np.random.default_rng(0), np.zeros(3), np.ones(3), []
    with OrganVectorEnv(bundle, "press", 16, size=None) as env:
        for i in range(rounds):
            policies = mean + spread * random.normal(size=(16, 3))
            gain, done = play(env, policies, seed=16 * i)
            best = policies[np.argsort(gain)[-4:]]
            mean, spread = best.mean(0), best.std(0) + 0.2 * 0.8**i
            solved.append(done.mean())
            print(f"round {i}: {done.sum()} of 16 solved, reward {gain.mean():.2f}", flush=True)
        done = play(env, np.tile(mean, (16, 1)), seed=10**6)[1]
        print(f"the policy {mean.round(2)} solves {done.sum()} of 16 that it has not seen")
    points = " ".join(f"{40 + 340 * i / (rounds - 1):.0f},{190 - 170 * s:.0f}" for i, s in enumerate(solved))
    with open(curve, "w") as file:
        file.write('<svg xmlns="http://www.w3.org/2000/svg" width="400" height="220" '
                   'font-family="sans-serif" font-size="12"><rect width="400" height="220" fill="#fff"/>'
                   '<path d="M40 20V190H380" fill="none" stroke="#000"/><text x="8" y="24">all</text>'
                   '<text x="8" y="194">none</text><text x="150" y="210">solved, by round</text>'
                   f'<polyline points="{points}" fill="none" stroke="#06c" stroke-width="2"/></svg>\n')


if __name__ == "__main__":
    if "--help" in sys.argv or "-h" in sys.argv:
        sys.exit(print(__doc__.strip()))
    if len(sys.argv) != 3:
        sys.exit(__doc__.splitlines()[0])
    main(*sys.argv[1:])
