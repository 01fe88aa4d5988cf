# SPDX-License-Identifier: Apache-2.0
"""Pokes and draws organs baked by organbake, on the CPU, with the truth beside every picture."""

from os import PathLike
from typing import Final, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Floats = Union[NDArray[np.float32], NDArray[np.float64]]
_Path = Union[str, "PathLike[str]"]

_Layers = Union[str, Sequence[str]]

__version__: str

class View:
    def __init__(self, width: int, height: int, fx: float, fy: float,
                 cx: Optional[float] = None, cy: Optional[float] = None, *,
                 camera_from_world: ArrayLike, near_mm: float = 1.0) -> None: ...
    @staticmethod
    def look_at(eye_mm: ArrayLike, target_mm: ArrayLike, up: ArrayLike = (0, 0, 1), *,
                width: int = 640, height: int = 480, fx: float = 600.0) -> "View": ...
    width: Final[int]
    height: Final[int]
    intrinsics: Final[Tuple[float, float, float, float]]
    camera_from_world: Final[NDArray[np.float64]]

class Scope:
    def __init__(self, file: _Path) -> None: ...
    size: Final[Tuple[int, int]]

class State:
    steps: Final[int]

class Picture:
    rgb: Final[NDArray[np.uint8]]
    right_rgb: Final[Optional[NDArray[np.uint8]]]
    depth_mm: Final[Optional[NDArray[np.float32]]]
    normals: Final[Optional[NDArray[np.float32]]]
    mask: Final[Optional[NDArray[np.uint8]]]
    skin: Final[Optional[NDArray[np.void]]]
    organ: Final[Optional[NDArray[np.uint8]]]
    weight: Final[Optional[NDArray[np.float32]]]
    flow_back: Final[Optional[NDArray[np.float32]]]
    flow_back_seen: Final[Optional[NDArray[np.bool_]]]
    flow_from_last: Final[Optional[NDArray[np.float32]]]
    flow_from_last_seen: Final[Optional[NDArray[np.bool_]]]

class Pictures:
    rgb: Final[NDArray[np.uint8]]
    depth_mm: Final[Optional[NDArray[np.float32]]]
    normals: Final[Optional[NDArray[np.float32]]]
    mask: Final[Optional[NDArray[np.uint8]]]
    flow_back: Final[Optional[NDArray[np.float32]]]
    flow_back_seen: Final[Optional[NDArray[np.bool_]]]

class Mesh:
    vertices_mm: Final[NDArray[np.float64]]
    faces: Final[NDArray[np.uint32]]
    vertex_mass_kg: Final[NDArray[np.float64]]
    vertex_anchors: Final[NDArray[np.uint32]]
    spring_ends: Final[NDArray[np.uint32]]
    spring_length_mm: Final[NDArray[np.float64]]
    spring_stiffness_n_per_mm: Final[NDArray[np.float64]]
    spring_damping_n_s_per_mm: Final[NDArray[np.float64]]
    nodes_mm: Final[NDArray[np.float64]]
    tetrahedra: Final[NDArray[np.uint32]]
    fill: Final[NDArray[np.float64]]
    node_mass_kg: Final[NDArray[np.float64]]
    node_anchors: Final[NDArray[np.uint32]]
    vertex_tetrahedron: Final[NDArray[np.uint32]]
    vertex_weights: Final[NDArray[np.float64]]
    patch_first: Final[NDArray[np.uint32]]
    patch_nodes: Final[NDArray[np.uint32]]
    patch_weights: Final[NDArray[np.float64]]
    skin_first: Final[NDArray[np.uint32]]
    skin_carriers: Final[NDArray[np.uint32]]
    skin_weights: Final[NDArray[np.float64]]
    skin_faces: Final[NDArray[np.uint32]]
    young_modulus_kpa: Final[float]
    density_kg_per_m3: Final[float]
    thickness_mm: Final[float]
    volume_stiffness: Final[float]
    poisson_ratio: Final[float]
    damping_s: Final[float]

class Step:
    forces_n: Final[NDArray[np.float64]]
    positions_mm: Final[NDArray[np.float64]]
    contact_points: Final[NDArray[np.void]]
    contacts: Final[int]
    tissue_contacts: Final[int]
    tool_contacts: Final[int]
    penetration_mm: Final[float]
    slipped: Final[int]
    recovered: Final[bool]
    tip_too_fast: Final[bool]

class Player:
    def __init__(self, bundles: Union[_Path, Sequence[_Path]], *, time_step_s: float = 1 / 60,
                 solver: Optional[str] = None, light: Optional[str] = None,
                 threads: Optional[int] = None) -> None: ...
    def save_state(self) -> State: ...
    def restore_state(self, state: State) -> None: ...
    def step(self, positions_mm: ArrayLike = (), *, radius_mm: ArrayLike = 5.0,
             axis_mm: Optional[ArrayLike] = None, grabs: ArrayLike = False,
             cuts: ArrayLike = False, snips: ArrayLike = False,
             opening_mm: Optional[ArrayLike] = None, cut_width_mm: ArrayLike = 0.0, pierces: ArrayLike = False,
             active: ArrayLike = True) -> Step: ...
    def place_tools(self, positions_mm: ArrayLike = (), *, radius_mm: ArrayLike = 5.0,
             axis_mm: Optional[ArrayLike] = None, grabs: ArrayLike = False,
             cuts: ArrayLike = False, snips: ArrayLike = False,
             opening_mm: Optional[ArrayLike] = None, cut_width_mm: ArrayLike = 0.0, pierces: ArrayLike = False,
             active: ArrayLike = True) -> None: ...
    def contact_forces(self, positions_mm: ArrayLike = (), *, radius_mm: ArrayLike = 5.0,
             axis_mm: Optional[ArrayLike] = None, grabs: ArrayLike = False,
             cuts: ArrayLike = False, snips: ArrayLike = False,
             opening_mm: Optional[ArrayLike] = None, cut_width_mm: ArrayLike = 0.0, pierces: ArrayLike = False,
             active: ArrayLike = True,
                       organ: int = 0, nodes: bool = False) -> NDArray[np.float64]: ...
    def set_vertices(self, positions_mm: _Floats, organ: int = 0) -> None: ...
    def set_nodes(self, positions_mm: _Floats, organ: int = 0) -> None: ...
    def mesh(self, organ: int = 0) -> Mesh: ...
    def draw_many(self, states: _Floats, views: Union[View, Sequence[View]],
                  layers: _Layers = "", *, nodes: bool = False,
                  out: Union[Pictures, NDArray[np.uint8], None] = None,
                  organ: int = 0) -> Pictures: ...
    def reset(self, stiffness: Optional[float] = None) -> None: ...
    def close(self) -> None: ...
    def orbit(self, azimuth_rad: float = 0.0, elevation_rad: float = 0.0, distance: float = 1.0,
              *, width: int = 640, height: int = 480) -> View: ...
    def draw(self, view: View, layers: _Layers = "", *, tools: bool = True,
             out: Optional[NDArray[np.uint8]] = None, scope: Optional[Scope] = None,
             light: Optional[str] = None, gain: float = 1.0, noise: float = 0.0, seed: int = 0,
             stereo_mm: Optional[float] = None) -> Picture: ...
    def proxy_mm(self, organ: int = 0) -> NDArray[np.float64]: ...
    def proxy_faces(self, organ: int = 0) -> NDArray[np.uint32]: ...
    def skin_point(self, direction: ArrayLike) -> Tuple[float, float, float]: ...
    organ_count: Final[int]

def show(what: Union[Player, _Path], azimuth_rad: float = 0.0, elevation_rad: float = 0.0, *,
         width: int = 640, height: int = 480) -> object: ...
