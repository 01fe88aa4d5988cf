# SPDX-License-Identifier: Apache-2.0
"""What a learner is asked to do with an organ: press a place to a force, grasp and lift it, cut
along a line. Each task has a scripted expert. Millimetres (LPS) and newtons; a step is 1/60 s."""
import math
from typing import Any, Dict, Optional

import numpy as np

from ._organplay import Player, Step

MOTION_MM = 2.0  # of the tip in a step, for an action of 1
HELD_STEPS = 10  # that a task must be solved for without a break
_TRIES = 200


class World:
    """One organ with one tool: what a task and its expert see of it.

    tip_mm, target_mm, end_mm (3,): the tool's tip, the place of the skin that is asked for, and
    where a line that begins there ends. out (3,): unit, from the organ to the tool. wanted: what
    measured is to become, in the task's unit. force_n (3,): on the tool, from the tissue. notes: what
    a task keeps for itself.
    """

    def __init__(self, player: Player, width: int, height: int) -> None:
        self.player, self.size = player, (width, height)
        mesh = player.mesh()
        # Tissue that hangs on something moves little, and where it hangs, not at all.
        self._held_mm = mesh.vertices_mm[mesh.vertex_anchors]
        self._free_mm = min(15.0, 0.06 * float(np.linalg.norm(np.ptp(mesh.vertices_mm, axis=0))))
        self.random = np.random.default_rng()
        self.look: Dict[str, Any] = {}  # of this episode's pictures
        self.look_from()
        self.begin()

    def look_from(self, *angles_and_distance: float) -> None:
        """The view, as Player.orbit() takes it."""
        self.view = self.player.orbit(*angles_and_distance, width=self.size[0], height=self.size[1])

    def begin(self, stiffness: float = 1.0) -> None:
        """Back to rest; a task then says what is wanted."""
        self.player.reset(stiffness)
        self.tip_mm, self.target_mm, self.end_mm = np.zeros((3, 3))
        self.out, self.force_n = np.zeros((2, 3))
        self.wanted, self.measured = 0.0, 0.0
        self.closed, self.solved = False, False
        self.steps, self.held = 0, 0
        self.step: Optional[Step] = None
        self.notes: Dict[str, Any] = {}

    def towards(self, axis: np.ndarray, angle_rad: float) -> np.ndarray:
        """(3,), unit: evenly from the cap of directions within an angle of another."""
        cosine = self.random.uniform(np.cos(angle_rad), 1)
        turn = self.random.uniform(0, 2 * np.pi)
        aside = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        aside /= np.linalg.norm(aside)
        across = np.cos(turn) * aside + np.sin(turn) * np.cross(axis, aside)
        return cosine * axis + np.sqrt(1 - cosine**2) * across

    def skin(self, axis: np.ndarray, angle_rad: float, near_mm: float = 0.0,
             far_mm: float = np.inf, of_mm: Optional[np.ndarray] = None) -> Any:
        """A direction within an angle of another in which there is skin, and the place there, at
        near_mm to far_mm from another place, and free to move. Raises ValueError where none is
        found."""
        for _ in range(_TRIES):
            # Another place may lie at any angle: as many are tried near by as farther off.
            share = 1.0 if of_mm is None else self.random.uniform()
            out = self.towards(axis, share * angle_rad)
            try:
                place = np.array(self.player.skin_point(out))
            except ValueError:
                continue
            held = np.linalg.norm(self._held_mm - place, axis=1)
            if len(held) and held.min() < self._free_mm:
                continue
            if of_mm is None or near_mm <= np.linalg.norm(place - of_mm) <= far_mm:
                return out, place
        raise ValueError("the organ has no skin that this task could be set on from this side")

    @property
    def to_eye(self) -> np.ndarray:
        """(3,), unit, from what the view shows to its eye."""
        return -self.view.camera_from_world[2, :3]

    def split(self, from_mm: np.ndarray) -> Any:
        """How far the tip lies out from a place, mm, and (3,) how far aside of it."""
        away = self.tip_mm - from_mm
        height = float(away @ self.out)
        return height, away - height * self.out


def _moved(by_mm: np.ndarray, most_mm: float = MOTION_MM) -> np.ndarray:
    """(3,): the action that moves the tip so far, or towards it at most so much."""
    length = math.hypot(*by_mm)
    return by_mm * min(1.0, most_mm / max(length, 1e-12)) / MOTION_MM


class Task:
    """What is wanted of worlds. A task of one's own overrides all five methods; actions: how many
    numbers an action has, the first three of which move the tip; most_steps: of an episode."""

    name = "task"
    actions = 3
    most_steps = 200
    cuts = False

    def begin(self, world: World) -> None:
        """Chooses by world.random the target and what is wanted, and where the tip begins."""
        raise NotImplementedError

    def tips(self, world: World) -> Dict[str, Any]:
        """The arguments of Player.step() beside the tip's place."""
        raise NotImplementedError

    def measure(self, world: World) -> float:
        """What has been reached, by world.step, in the unit of world.wanted."""
        raise NotImplementedError

    def reached(self, world: World) -> bool:
        """Whether what is measured is what is wanted, now."""
        return world.measured >= world.wanted

    def expert(self, world: World) -> np.ndarray:
        """(actions,): what one would do who sees all of the world."""
        raise NotImplementedError

    def reward(self, world: World) -> float:
        """Of a step, unless the environment is given another: 1 when it is solved, else less than
        0, by what is left of the way and of what is wanted."""
        if world.solved:
            return 1.0
        missing = abs(world.wanted - world.measured) / max(world.wanted, 1e-9)
        away = math.dist(world.tip_mm, world.target_mm)
        return -0.01 * min(missing, 1.0) - 0.0005 * min(away, 20.0)


class Press(Task):
    """A ball of radius_mm is to press a place with a force, in newtons, to a tenth of it."""

    name = "press"

    def __init__(self, radius_mm: float = 5.0, force_n: Any = (0.2, 0.8), cone_rad: float = 0.5,
                 within: float = 0.1, aside_mm: float = 3.0) -> None:
        self.radius_mm, self.force_n, self.cone_rad = radius_mm, force_n, cone_rad
        self.within, self.aside_mm = within, aside_mm

    def begin(self, world: World) -> None:
        world.out, world.target_mm = world.skin(world.to_eye, self.cone_rad)
        world.end_mm = world.target_mm
        world.wanted = world.random.uniform(*self.force_n)
        aside = world.towards(world.out, 0.5) - world.out
        world.tip_mm = world.target_mm + (self.radius_mm + 10) * world.out + 20 * aside

    def tips(self, world: World) -> Dict[str, Any]:
        return {"radius_mm": self.radius_mm}

    def measure(self, world: World) -> float:
        return math.hypot(*world.force_n)

    def reached(self, world: World) -> bool:
        return (abs(world.measured - world.wanted) <= self.within * world.wanted
                and math.hypot(*world.split(world.target_mm)[1]) <= self.aside_mm)

    def expert(self, world: World) -> np.ndarray:
        height, aside = world.split(world.target_mm)
        if math.hypot(*aside) > 1 and world.measured == 0:
            return _moved(-aside)
        if world.measured == 0:  # down to where the skin was, then slowly
            return _moved(-max(0.5, height - self.radius_mm - 1) * world.out)
        # Tissue yields some millimetres to a newton; by half of what is missing it swings not.
        inwards = min(max(1.5 * (world.wanted - world.measured), -0.5), 0.5)
        return _moved(-0.2 * aside - inwards * world.out)


class Lift(Task):
    """A grasper is to hold a place of the skin so many millimetres above its rest. The fourth
    number of an action closes its jaws above 0 and opens them below."""

    name = "lift"
    actions = 4

    def __init__(self, radius_mm: float = 3.0, lift_mm: Any = (3.0, 8.0), cone_rad: float = 0.5) -> None:
        self.radius_mm, self.lift_mm, self.cone_rad = radius_mm, lift_mm, cone_rad

    def begin(self, world: World) -> None:
        world.out, world.target_mm = world.skin(world.to_eye, self.cone_rad)
        world.wanted = world.random.uniform(*self.lift_mm)
        world.end_mm = world.target_mm + world.wanted * world.out
        aside = world.towards(world.out, 0.5) - world.out
        world.tip_mm = world.target_mm + (self.radius_mm + 10) * world.out + 20 * aside

    def tips(self, world: World) -> Dict[str, Any]:
        return {"radius_mm": self.radius_mm, "grabs": world.closed}

    def measure(self, world: World) -> float:
        points = world.step.contact_points
        held = points["depth_mm"][points["carried"]]
        aside = math.hypot(*world.split(world.target_mm)[1])
        return float(np.median(held)) if len(held) and aside <= 2 * self.radius_mm else 0.0

    def expert(self, world: World) -> np.ndarray:
        height, aside = world.split(world.target_mm)
        carries = world.step is not None and world.step.contact_points["carried"].any()
        if carries:
            left = min(max(world.wanted + 0.5 - world.measured, 0), 0.5)
            return np.append(_moved(left * world.out), 1.0)
        if math.hypot(*aside) > 1 and height > self.radius_mm:
            return np.append(_moved(-aside), -1.0)
        if height > self.radius_mm - 1:
            return np.append(_moved((self.radius_mm - 1.2 - height) * world.out), -1.0)
        return np.append(np.zeros(3), 1.0)


class Cut(Task):
    """A hook's edge is to cut along a line of length_mm on the skin, depth_mm deep. Measured: the
    share of places along the line, half as deep, at which the organ's own new walls lie within
    beside_mm. Takes an organ with tetrahedra; of one that is cut there are pictures, no layers."""

    name = "cut"
    most_steps = 250
    cuts = True
    edge_mm, thickness_mm, places = 30.0, 0.5, 12

    def __init__(self, length_mm: Any = (10.0, 25.0), depth_mm: float = 5.0, share: float = 0.95,
                 beside_mm: float = 2.0, cone_rad: float = 0.4) -> None:
        self.length_mm, self.depth_mm, self.share = length_mm, depth_mm, share
        self.beside_mm, self.cone_rad = beside_mm, cone_rad

    def begin(self, world: World) -> None:
        for _ in range(20):
            world.out, world.target_mm = world.skin(world.to_eye, self.cone_rad)
            to, world.end_mm = world.skin(world.out, 1.0, *self.length_mm, of_mm=world.target_mm)
            line = self._line(world, to)
            if line is not None:
                break
        else:
            raise ValueError("no line of this length lies on one fold of the organ's skin")
        world.wanted = self.share
        world.tip_mm = world.target_mm + 10 * world.out
        whole = len(world.player.proxy_mm())
        world.notes = {"line": line, "whole": whole, "now": whole, "next": 0}

    def _line(self, world: World, to: np.ndarray) -> Optional[np.ndarray]:
        """(places, 3): on the skin from target to end, or None where they lie on two folds, or the
        skin turns away from the hook."""
        shares = np.linspace(0, 1, self.places)[:, None]
        try:
            line = np.array([world.player.skin_point(d)
                             for d in (1 - shares) * world.out + shares * to])
        except ValueError:
            return None
        paces = np.diff(line, axis=0)
        length = np.linalg.norm(paces, axis=1)
        steep = np.abs(paces @ world.out) > 0.8 * length
        return None if (length > 3 * length.mean()).any() or steep.any() else line

    def tips(self, world: World) -> Dict[str, Any]:
        return {"radius_mm": self.thickness_mm, "cuts": True,
                "axis_mm": [self.edge_mm * world.out]}

    def measure(self, world: World) -> float:
        now = len(world.player.proxy_mm())
        if now == world.notes["now"]:  # no wall is new
            return world.measured
        world.notes["now"] = now
        walls = world.player.mesh().vertices_mm[world.notes["whole"]:]
        places = world.notes["line"] - 0.5 * self.depth_mm * world.out
        near = np.linalg.norm(walls[None] - places[:, None], axis=2).min(axis=1)
        return float((near <= self.beside_mm).mean())

    def expert(self, world: World) -> np.ndarray:
        line, at = world.notes["line"], world.notes["next"]
        beyond = line[-1] - line[-2]
        way = np.vstack([line, line[-1] + 2 * beyond / np.linalg.norm(beyond)])
        way = way - self.depth_mm * world.out
        if at < len(way) - 1 and math.dist(way[at], world.tip_mm) < 0.2:
            at = world.notes["next"] = at + 1
        return _moved(way[at] - world.tip_mm, 2.0 if at == 0 else 1.5)


TASKS = {"press": Press, "lift": Lift, "cut": Cut}
