# SPDX-License-Identifier: Apache-2.0
"""Many organs at once as a learner sees them: an environment with the interface of Gymnasium's
gymnasium.vector.VectorEnv. It is one where Gymnasium is installed, and works the same without."""
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Callable, Dict, Optional, Sequence, Tuple, Union

import numpy as np

from ._organplay import Player, Scope
from .tasks import HELD_STEPS, MOTION_MM, TASKS, Task, World

try:
    from gymnasium.spaces import Box, Dict as DictSpace
    from gymnasium.vector import AutoresetMode, VectorEnv
    NEXT_STEP: Any = AutoresetMode.NEXT_STEP
except ImportError:
    VectorEnv, NEXT_STEP = object, "NextStep"

    class Box:  # type: ignore[no-redef]
        """Numbers of a shape between low and high: what is used of gymnasium.spaces.Box."""

        def __init__(self, low: Any, high: Any, shape: Sequence[int], dtype: Any) -> None:
            self.shape, self.dtype = tuple(shape), np.dtype(dtype)
            self.low = np.full(self.shape, low, self.dtype)
            self.high = np.full(self.shape, high, self.dtype)
            self.random = np.random.default_rng()

        def seed(self, seed: Optional[int] = None) -> None:
            self.random = np.random.default_rng(seed)

        def sample(self) -> np.ndarray:
            low, high = np.nan_to_num(self.low.astype(float)), np.nan_to_num(self.high.astype(float))
            return self.random.uniform(low, high).astype(self.dtype)

        def contains(self, x: Any) -> bool:
            return (isinstance(x, np.ndarray) and x.shape == self.shape and x.dtype == self.dtype
                    and bool((x >= self.low).all() and (x <= self.high).all()))

    class DictSpace(dict):  # type: ignore[no-redef,type-arg]
        """Spaces by name: what is used of gymnasium.spaces.Dict."""

        def contains(self, x: Any) -> bool:
            return set(x) == set(self) and all(self[k].contains(v) for k, v in x.items())


STATE = 16  # numbers of the observation "state"
_LAYERS = {"depth": ("depth_mm", (), np.float32, 0, np.inf), "mask": ("mask", (), np.uint8, 0, 255),
           "flow": ("flow_back", (2,), np.float32, -np.inf, np.inf)}


class EnvironmentClosed(RuntimeError):
    """The environment was closed; make another one."""


class EnvironmentBusy(RuntimeError):
    """Another thread is in reset() or step(); nothing was done."""


@dataclass(frozen=True)
class Looks:
    """What an episode's pictures and tissue are drawn from, by the world's own seed. Each range is
    (low, high): the view's angles about that from virtual camera 0, its distance in multiples of
    that camera's, the gain of linear light, the noise in levels of 255, and the tissue's stiffness
    in multiples of what was baked."""

    azimuth_rad: Tuple[float, float] = (0.0, 0.0)
    elevation_rad: Tuple[float, float] = (0.0, 0.0)
    distance: Tuple[float, float] = (1.0, 1.0)
    gain: Tuple[float, float] = (1.0, 1.0)
    noise: Tuple[float, float] = (0.0, 0.0)
    stiffness: Tuple[float, float] = (1.0, 1.0)
    lights: Sequence[Optional[str]] = (None,)  # baked, world, scope; None: the organ's own
    scopes: Sequence[Optional[Scope]] = (None,)


class OrganVectorEnv(VectorEnv):  # type: ignore[misc,valid-type]
    """num_envs organs, each with a tool, and one task for all.

    bundles: a folder made by organbake bake, or a list that the worlds take in turn. task: press,
    lift, cut, or a tasks.Task. size: width and height of pictures, px; None: no pictures, which is
    many times as fast. layers: of depth, mask and flow. reward: of a World after a step, a number;
    None: the task's own. looks: how episodes differ. threads: that worlds are shared out to; None:
    as many as there are processors. The same seeds and actions give the same bytes for any number.

    Actions: (num_envs, task.actions) float, -1 to 1: the tip moves 2 mm a step along x, y and z of
    the world (LPS); then what the task names. The tip stays within reach_mm of its target.
    Observations, by name: state (N, 16) float32, of tip - target (3), end - target (3), the
    direction from the organ to the tool (3), the force on the tool (3; N), what is wanted, what is
    measured, jaws closed (0, 1), share of most_steps left; rgb (N, h, w, 3) uint8; depth_mm
    (N, h, w) float32, inf behind the organ; mask (N, h, w) uint8; flow_back (N, h, w, 2) float32,
    0 in an episode's first picture. infos: solved, measured, wanted, force_n, each by world.
    A world that ended begins anew in the step that follows, whose action it ignores (NEXT_STEP).
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 60, "autoreset_mode": NEXT_STEP}
    render_mode = "rgb_array"
    spec = None
    reach_mm = 60.0

    def __init__(self, bundles: Any, task: Union[str, Task] = "press", num_envs: int = 4, *,
                 size: Optional[Tuple[int, int]] = (128, 128), layers: Sequence[str] = (),
                 reward: Optional[Callable[[World], float]] = None, looks: Looks = Looks(),
                 threads: Optional[int] = None, max_steps: Optional[int] = None, solver: Optional[str] = None) -> None:
        self.closed = True  # until all is there
        if isinstance(task, str) and task not in TASKS:
            raise ValueError(f"task '{task}' is none; take {', '.join(TASKS)}, or give a Task")
        self.task: Task = TASKS[task]() if isinstance(task, str) else task
        if threads is None:
            threads = os.cpu_count() or 1
        for name, number in (("num_envs", num_envs), ("threads", threads)):
            if number < 1:
                raise ValueError(f"{name} is {number}; it must be 1 or more")
        for layer in layers:
            if layer not in _LAYERS:
                raise ValueError(f"layer '{layer}' is none of depth, mask, flow")
        if layers and (size is None or self.task.cuts):
            raise ValueError("layers need pictures: give a size" if size is None else
                             "of an organ that is cut there are pictures, but no layers")
        folders = list(bundles) if isinstance(bundles, (list, tuple)) else [bundles]
        self.num_envs, self.size, self.layers = num_envs, size, tuple(layers)
        self.reward, self.looks = reward or self.task.reward, looks
        self.max_steps = max_steps or self.task.most_steps
        # Worlds have a thread each, but a single one has all of them.
        each = None if num_envs == 1 else 1
        self._worlds = [World(Player(folders[i % len(folders)], solver=solver, threads=each),
                              *(size or (64, 64))) for i in range(num_envs)]
        self._ended = np.ones(num_envs, bool)
        self._begun = False
        self._lock = threading.Lock()
        self._threads = min(threads, num_envs)
        self._pool = ThreadPoolExecutor(self._threads)
        self._spaces()
        self.closed = False

    def _spaces(self) -> None:
        shapes: Dict[str, Any] = {"state": ((STATE,), np.float32, -np.inf, np.inf)}
        if self.size:
            width, height = self.size
            shapes["rgb"] = ((height, width, 3), np.uint8, 0, 255)
            for layer in self.layers:
                name, of, kind, low, high = _LAYERS[layer]
                shapes[name] = ((height, width) + of, kind, low, high)

        def boxes(before: Tuple[int, ...]) -> Any:
            return DictSpace({name: Box(low, high, before + shape, kind)
                              for name, (shape, kind, low, high) in shapes.items()})

        self._shapes = shapes
        self.single_observation_space, self.observation_space = boxes(()), boxes((self.num_envs,))
        self.single_action_space = Box(-1.0, 1.0, (self.task.actions,), np.float32)
        self.action_space = Box(-1.0, 1.0, (self.num_envs, self.task.actions), np.float32)

    @property
    def worlds(self) -> Sequence[World]:
        """What no learner sees: the worlds themselves, for experts and rewards."""
        return self._worlds

    def expert_actions(self) -> np.ndarray:
        """(num_envs, task.actions) float32: what the task's scripted expert would do now."""
        return np.array([self.task.expert(world) for world in self._worlds], np.float32)

    def _enter(self) -> None:
        if self.closed:
            raise EnvironmentClosed("the environment was closed; make another one")
        if not self._lock.acquire(blocking=False):
            raise EnvironmentBusy("another thread is in reset() or step() of this environment")

    def reset(self, *, seed: Union[int, Sequence[int], None] = None,
              options: Optional[Dict[str, Any]] = None) -> Tuple[Dict[str, np.ndarray], Dict[str, Any]]:
        """Begins an episode in every world, or later in those of options["reset_mask"], (num_envs,) bool.
        seed: of the first world, those after it have the next ones; or one for each. None: chance
        goes on where it was. Returns observations and infos."""
        self._enter()
        try:
            chosen = np.array((options or {}).get("reset_mask", np.ones(self.num_envs)), bool)
            chosen |= not self._begun
            seeds = [None] * self.num_envs if seed is None else (
                [int(seed) + i for i in range(self.num_envs)] if np.ndim(seed) == 0 else list(seed))
            for name, given in (("reset_mask", chosen), ("seed", seeds)):
                if len(given) != self.num_envs:
                    raise ValueError(f"{name} holds {len(given)} for {self.num_envs} worlds")
            for world, own in zip(self._worlds, seeds):
                if own is not None:
                    world.random = np.random.default_rng(own)
            observations = self._room()
            self._for_all(range(self.num_envs), lambda i: self._begin(i, observations)
                          if chosen[i] else self._draw(i, observations))
            self._ended[chosen] = False
            self._begun = True
            return observations, self._told(observations)
        finally:
            self._lock.release()

    def _begin(self, i: int, observations: Dict[str, np.ndarray]) -> None:
        world, looks = self._worlds[i], self.looks
        draw = world.random.uniform
        # Where all tissue is alike no number is drawn: episodes are what they were without.
        world.begin(draw(*looks.stiffness) if looks.stiffness != (1, 1) else 1.0)
        world.look_from(draw(*looks.azimuth_rad), draw(*looks.elevation_rad), draw(*looks.distance))
        world.look = {"gain": draw(*looks.gain), "noise": draw(*looks.noise),
                      "light": looks.lights[world.random.integers(len(looks.lights))],
                      "scope": looks.scopes[world.random.integers(len(looks.scopes))],
                      "seed": int(world.random.integers(2**31))}
        self.task.begin(world)
        self._draw(i, observations)

    def _checked(self, actions: Any) -> np.ndarray:
        """All of them, before any world moves. Raises ValueError."""
        try:
            numbers = np.asarray(actions, dtype=float)
        except (TypeError, ValueError):
            raise ValueError("actions are no array of numbers") from None
        wanted = (self.num_envs, self.task.actions)
        if numbers.shape != wanted:
            raise ValueError(f"actions have the shape {numbers.shape}; it must be {wanted}")
        bad = ~(np.abs(numbers) <= 1 + 1e-6)  # of no number, too
        if bad.any():
            i, k = np.argwhere(bad)[0]
            raise ValueError(f"action {k} of world {i} is {numbers[i, k]:g}; it must be -1 to 1 "
                             f"({MOTION_MM:g} mm a step)")
        return np.clip(numbers, -1, 1)

    def step(self, actions: Any) -> Tuple[Dict[str, np.ndarray], np.ndarray, np.ndarray, np.ndarray,
                                          Dict[str, Any]]:
        """Returns observations, rewards (N,) float64, terminations (solved for 10 steps on end) and
        truncations (after max_steps), (N,) bool, and infos. Raises ValueError for actions that are
        none, EnvironmentClosed and EnvironmentBusy, and has then moved nothing."""
        self._enter()
        try:
            if not self._begun:
                raise RuntimeError("call reset() before the first step()")
            going = np.flatnonzero(~self._ended).tolist()
            self._advance(going, self._checked(actions))
            observations, rewards = self._room(), np.zeros(self.num_envs)
            for i in going:
                rewards[i] = self._judged(self._worlds[i])
            self._for_all(range(self.num_envs), lambda i: self._begin(i, observations)
                          if self._ended[i] else self._draw(i, observations))
            infos = self._told(observations)
            late = (self._each("steps") >= self.max_steps) & ~infos["solved"]
            self._ended = infos["solved"] | late
            return observations, rewards, infos["solved"].copy(), late, infos
        finally:
            self._lock.release()

    def _each(self, name: str) -> np.ndarray:
        return np.array([getattr(world, name) for world in self._worlds])

    def _advance(self, going: Sequence[int], actions: np.ndarray) -> None:
        target = self._each("target_mm")
        away = self._each("tip_mm") + MOTION_MM * actions[:, :3] - target
        far = np.linalg.norm(away, axis=1, keepdims=True)
        tips = target + away * np.minimum(1.0, self.reach_mm / np.maximum(far, 1e-9))

        def step(i: int) -> None:
            world = self._worlds[i]
            world.step = world.player.step(tips[i:i + 1], **self.task.tips(world))

        for i in going:
            self._worlds[i].tip_mm = tips[i]
            self._worlds[i].closed = self.task.actions > 3 and bool(actions[i, 3] > 0)
        self._for_all(going, step)

    # One world after the other: between steps and pictures, which leave nothing of Python's own part
    # in the processor's caches, it takes half as long again, or twice.
    def _judged(self, world: World) -> float:
        world.force_n = world.step.forces_n[0]  # type: ignore[union-attr]
        world.measured = self.task.measure(world)
        world.steps += 1
        world.held = world.held + 1 if self.task.reached(world) else 0
        world.solved = world.held >= HELD_STEPS
        return self.reward(world)

    def _for_all(self, worlds: Sequence[int], work: Callable[[int], None]) -> None:
        left = iter(worlds)  # each thread takes the next

        def take(_: int = 0) -> None:
            for i in left:
                work(i)

        if self._threads == 1 or len(worlds) < 2:
            return take()
        for _ in self._pool.map(take, range(self._threads)):
            pass

    def _room(self) -> Dict[str, np.ndarray]:
        return {name: np.zeros((self.num_envs,) + shape, kind)
                for name, (shape, kind, _, _) in self._shapes.items()}

    def _draw(self, i: int, observations: Dict[str, np.ndarray]) -> None:
        world = self._worlds[i]
        if not self.size:
            return
        if world.steps == 0:  # no step has told the player where its tool is
            world.player.place_tools([world.tip_mm], **self.task.tips(world))
        look = {**world.look, "seed": world.look["seed"] + world.steps}
        picture = world.player.draw(world.view, self.layers, out=observations["rgb"][i], **look)
        for layer in self.layers:
            name = _LAYERS[layer][0]
            plane = getattr(picture, name)
            if plane is not None:  # flow of a first picture
                observations[name][i] = plane

    def _told(self, observations: Dict[str, np.ndarray]) -> Dict[str, Any]:
        """Fills in the states; returns infos."""
        target, force, wanted, measured = map(self._each, ("target_mm", "force_n", "wanted", "measured"))
        observations["state"][:] = np.column_stack([
            self._each("tip_mm") - target, self._each("end_mm") - target, self._each("out"), force,
            wanted, measured, self._each("closed"), 1 - self._each("steps") / self.max_steps])
        infos = {"solved": self._each("solved"), "measured": measured, "wanted": wanted,
                 "force_n": np.linalg.norm(force, axis=1)}
        return {**infos, **{"_" + name: np.ones(self.num_envs, bool) for name in infos}}

    def render(self) -> Tuple[np.ndarray, ...]:
        """A picture (h, w, 3) uint8 of each world, as its view shows it now."""
        self._enter()
        try:
            return tuple(w.player.draw(w.view).rgb for w in self._worlds)
        finally:
            self._lock.release()

    def close(self, **kwargs: Any) -> None:
        """Frees the organs; a second time does no harm."""
        if self.closed:
            return
        self.closed = True
        self._pool.shutdown()
        for world in self._worlds:
            world.player.close()

    @property
    def unwrapped(self) -> "OrganVectorEnv":
        return self

    def __enter__(self) -> "OrganVectorEnv":
        return self

    def __exit__(self, *args: Any) -> None:
        self.close()

    def __del__(self) -> None:
        if not getattr(self, "closed", True):
            self.close()

    def __repr__(self) -> str:
        return f"OrganVectorEnv({self.task.name}, num_envs={self.num_envs})"
