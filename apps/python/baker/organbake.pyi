# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages of organbake as functions, with arrays in and out."""

from typing import Final, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

class Proxy:
    vertices_mm: Final[NDArray[np.float64]]
    faces: Final[NDArray[np.uint32]]
    rms_mm: Final[float]
    max_mm: Final[float]
    reverse_rms_mm: Final[float]
    reverse_max_mm: Final[float]
    volume_change: Final[float]
    closed_manifold: Final[bool]
    genus: Final[int]
    self_intersecting_faces: Final[int]

class Cameras:
    def __len__(self) -> int: ...
    size: Final[int]
    intrinsics: Final[NDArray[np.float64]]
    camera_from_world: Final[NDArray[np.float64]]
    triangles: Final[NDArray[np.uint32]]

class Maps:
    depth_mm: Final[NDArray[np.float32]]
    color: Final[NDArray[np.float32]]
    height_mm: Final[NDArray[np.float32]]
    face: Final[NDArray[np.uint32]]
    confidence: Final[NDArray[np.float32]]

class Pose:
    camera_from_world: Final[NDArray[np.float64]]
    verdict: Final[str]
    reason: Final[str]
    light: Final[str]
    correlation: Final[float]
    visible_share: Final[float]
    outline_share: Final[float]
    surface_sd_mm: Final[float]
    focal_scale: Final[float]

class Shaded:
    depth: Final[NDArray[np.float32]]
    normals: Final[NDArray[np.float32]]
    confidence: Final[NDArray[np.float32]]
    tissue: Final[NDArray[np.bool_]]
    intrinsics: Final[Tuple[float, float, float, float]]
    metric: Final[bool]
    verdict: Final[str]
    reason: Final[str]
    support: Final[float]

def surface(voxels: ArrayLike, spacing_mm: ArrayLike, *, origin_mm: ArrayLike = (0, 0, 0),
            direction: Optional[ArrayLike] = None, level: Optional[float] = None,
            label: Optional[int] = None, largest: int = 1, min_size_mm: float = 0.0,
            refine: bool = False, cap: bool | str = "flat", smooth_mm: float = 1.0,
            keep_volume: bool = True) -> Tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
def decimate(vertices_mm: ArrayLike, faces: ArrayLike, *, count: int = 80,
             method: str = "fitted", flips: bool = True) -> Proxy: ...
def place(vertices_mm: ArrayLike, faces: ArrayLike, *, count: int = 8, map_size: int = 512,
          field_of_view_rad: float = 0.6, margin: float = 0.03,
          cone_axis: Optional[ArrayLike] = None, cone_half_angle_rad: float = 0.5) -> Cameras: ...
def capture(vertices_mm: ArrayLike, faces: ArrayLike, proxy_vertices_mm: ArrayLike,
            proxy_faces: ArrayLike, cameras: Cameras, *, colors: Optional[ArrayLike] = None,
            rays_per_texel_side: int = 0, base_step_mm: float = 1.5) -> List[Maps]: ...
def register(vertices_mm: ArrayLike, faces: ArrayLike, image: NDArray[np.uint8],
             intrinsics: ArrayLike, *, start: Optional[ArrayLike] = None,
             mask: Optional[ArrayLike] = None, light: str = "auto", similarity: str = "radiance",
             free_focal: bool = False, closed_outline: bool = False) -> Pose: ...
def shade(image: NDArray[np.uint8], intrinsics: Optional[ArrayLike] = None, *,
          field_of_view_rad: float = 1.2217304763960306, range_mm: float = 0.0, albedo: float = 0.0,
          texture: float = 0.03, beam_exponent: float = 0.0, masks: bool = True,
          piecewise_albedo: bool = True, instruments: Optional[ArrayLike] = None) -> Shaded: ...
