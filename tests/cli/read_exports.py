#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the exports of a bundle by the formats' own descriptions, with nothing but Python.

usage: read_exports.py BUNDLE, in the folder with colmap/, transforms/, gltf/ and obj/. Ends with an
AssertionError at the first thing that another program would trip over.
"""
import json
import math
import pathlib
import struct
import sys

from read_png import png


def png_size(data):
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and data[12:16] == b"IHDR"
    return struct.unpack_from(">II", data, 16)


def surface(path):
    """Vertices and faces of the bundle's own binary PLY."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + 11
    header = data[:end].decode().split("\n")
    vertices = int([h for h in header if h.startswith("element vertex")][0].split()[2])
    faces = int([h for h in header if h.startswith("element face")][0].split()[2])
    kinds = [h.split()[1] for h in header[:[i for i, h in enumerate(header) if h.startswith("element face")][0]]
             if h.startswith("property")]
    layout = struct.Struct("<" + "".join({"double": "d", "float": "f", "uchar": "B"}[k] for k in kinds))
    points = [layout.unpack_from(data, end + i * layout.size)[:3] for i in range(vertices)]
    at = end + vertices * layout.size
    return points, [struct.unpack_from("<Biii", data, at + 13 * f)[1:] for f in range(faces)]


def sub(a, b): return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
def dot(a, b): return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
def along(a, d, t): return (a[0] + d[0] * t, a[1] + d[1] * t, a[2] + d[2] * t)


def to_triangle(p, a, b, c):
    """Squared distance of a point to a triangle (Ericson 2005, 5.1.5)."""
    ab, ac, ap = sub(b, a), sub(c, a), sub(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0 and d2 <= 0: q = a
    else:
        bp = sub(p, b); d3, d4 = dot(ab, bp), dot(ac, bp)
        cp = sub(p, c); d5, d6 = dot(ab, cp), dot(ac, cp)
        va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
        if d3 >= 0 and d4 <= d3: q = b
        elif vc <= 0 and d1 >= 0 and d3 <= 0: q = along(a, ab, d1 / (d1 - d3))
        elif d6 >= 0 and d5 <= d6: q = c
        elif vb <= 0 and d2 >= 0 and d6 <= 0: q = along(a, ac, d2 / (d2 - d6))
        elif va <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0: q = along(b, sub(c, b), (d4 - d3) / (d4 - d3 + d5 - d6))
        else:
            n = 1 / (va + vb + vc)
            q = along(along(a, ab, vb * n), ac, vc * n)
    return dot(sub(p, q), sub(p, q))


class Near:
    """Faces by the cells of a grid that they come near to."""

    def __init__(self, points, faces, cell=4.0):
        self.points, self.faces, self.cell, self.cells = points, faces, cell, {}
        for f, face in enumerate(faces):
            corners = [points[v] for v in face]
            low = [math.floor((min(c[k] for c in corners) - 1) / cell) for k in range(3)]
            high = [math.floor((max(c[k] for c in corners) + 1) / cell) for k in range(3)]
            for x in range(low[0], high[0] + 1):
                for y in range(low[1], high[1] + 1):
                    for z in range(low[2], high[2] + 1):
                        self.cells.setdefault((x, y, z), []).append(f)

    def distance(self, p):
        """Exact up to 1 mm."""
        faces = self.cells.get(tuple(math.floor(c / self.cell) for c in p), [])
        return math.sqrt(min((to_triangle(p, *(self.points[v] for v in self.faces[f])) for f in faces), default=1))


def quaternion_matrix(w, x, y, z):
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def lines(path):
    return [l for l in pathlib.Path(path).read_text().split("\n") if not l.startswith("#")]


ON_SURFACE_MM = 0.1  # the target for points
bundle = pathlib.Path(sys.argv[1])
skin = Near(*surface(bundle / "surface.ply"))
cameras_of_bundle = json.loads((bundle / "cameras.json").read_text())["cameras"]

# COLMAP: https://colmap.github.io/format.html
lenses = {}
for line in lines("colmap/sparse/0/cameras.txt"):
    if line:
        number, model, width, height, *values = line.split()
        assert model == "PINHOLE" and len(values) == 4
        lenses[int(number)] = (int(width), int(height), *map(float, values))
images, text = {}, lines("colmap/sparse/0/images.txt")
for i in range(0, len(text) - 1, 2):
    number, *pose, lens, name = text[i].split()
    pose = list(map(float, pose))
    seen = text[i + 1].split()
    assert len(seen) % 3 == 0
    images[int(number)] = (quaternion_matrix(*pose[:4]), pose[4:], lenses[int(lens)], name,
                           [(float(seen[k]), float(seen[k + 1]), int(seen[k + 2])) for k in range(0, len(seen), 3)])
assert [images[i][3] for i in sorted(images)] == [f"cam_00{i}.png" for i in range(4)]

scene = json.loads(pathlib.Path("colmap/scene.json").read_text())
pictures = {name: png(f"colmap/images/{name}") for _, _, _, name, _ in images.values()}
masks = {name: png(f"colmap/masks/{name}.png") for name in pictures}
depths = {name: png(f"colmap/depth/{name}") for name in pictures}
for name, (width, height, channels, bits, rows) in pictures.items():
    assert (width, height, channels, bits) == (48, 48, 4, 8)
    assert masks[name][2:4] == (1, 8) and depths[name][2:4] == (1, 16)
    inside = sum(v > 0 for row in masks[name][4] for v in row)
    assert 400 < inside < 48 * 48, inside
    partly = sum(0 < row[4 * x + 3] < 255 for row in rows for x in range(width))
    assert partly > 50, "outlines are smooth"
    assert all((masks[name][4][y][x] > 0) == (rows[y][4 * x + 3] >= 128) for y in range(height) for x in range(width))

points, tracks = {}, 0
for line in lines("colmap/sparse/0/points3D.txt"):
    if line:
        number, x, y, z, r, g, b, error, *track = line.split()
        points[int(number)] = (float(x), float(y), float(z))
        assert float(error) == 0 and len(track) >= 2 and len(track) % 2 == 0
        for k in range(0, len(track), 2):
            rotation, t, (_, _, fx, fy, cx, cy), name, sightings = images[int(track[k])]
            px, py, back = sightings[int(track[k + 1])]
            assert back == int(number)
            p = [dot(rotation[i], points[back]) + t[i] for i in range(3)]
            assert abs(fx * p[0] / p[2] + cx - px) < 0.01 and abs(fy * p[1] / p[2] + cy - py) < 0.01
            depth = depths[name][4][int(py)][int(px)] * scene["depth_unit_mm"]
            assert abs(depth - p[2]) < 40, "the depth picture shows the same skin"
            tracks += 1
        # The colour is that of the picture that the point was taken from.
assert len(points) > 2000 and tracks > len(points)
worst = max(skin.distance(p) for p in list(points.values())[::3])
assert worst <= ON_SURFACE_MM, worst
low, high = scene["bounds_mm"]
assert all(low[k] - 1 <= p[k] <= high[k] + 1 for p in points.values() for k in range(3))

# Every depth pixel, put back into the world, lies on the surface, too.
for rotation, t, (width, height, fx, fy, cx, cy), name, _ in images.values():
    for y in range(0, height, 5):
        for x in range(0, width, 5):
            z = depths[name][4][y][x] * scene["depth_unit_mm"]
            if z == 0 or pictures[name][4][y][4 * x + 3] < 255:
                continue
            p = [(x + 0.5 - cx) / fx * z - t[0], (y + 0.5 - cy) / fy * z - t[1], z - t[2]]
            world = tuple(sum(rotation[i][k] * p[i] for i in range(3)) for k in range(3))
            assert skin.distance(world) < 1, (name, x, y)

# transforms.json, as nerfstudio and instant-ngp read it
transforms = json.loads(pathlib.Path("transforms/transforms.json").read_text())
assert [f["file_path"] for f in transforms["frames"]] == [f"images/cam_00{i}.png" for i in range(4)]
for frame, (rotation, t, lens, name, _) in zip(transforms["frames"], images.values()):
    assert png("transforms/" + frame["file_path"])[2] == 4
    assert png("transforms/" + frame["depth_file_path"])[3] == 16
    m = frame["transform_matrix"]
    eye = [-sum(rotation[i][k] * t[i] for i in range(3)) for k in range(3)]
    assert all(abs(m[k][3] - eye[k]) < 1e-6 for k in range(3))
    assert all(abs(-m[k][2] - rotation[2][k]) < 1e-9 for k in range(3)), "OpenGL looks along -z"
    for k in range(3):
        assert 0 < transforms["scale"] * transforms["bounds_mm"][0][k] + transforms["offset"][k] < 1
cloud = pathlib.Path("transforms", transforms["ply_file_path"]).read_bytes()
count = int(cloud.split(b"element vertex ")[1].split(b"\n")[0])
body = cloud.index(b"end_header\n") + 11
assert count == len(points) and len(cloud) == body + 15 * count
first = struct.unpack_from("<fff", cloud, body)
assert max(abs(a - b) for a, b in zip(first, points[1])) < 1e-3

# glTF 2.0
data = pathlib.Path("gltf/organ.glb").read_bytes()
magic, version, length = struct.unpack_from("<4sII", data)
assert (magic, version, length) == (b"glTF", 2, len(data))
json_length = struct.unpack_from("<I", data, 12)[0]
gltf, start = json.loads(data[20:20 + json_length]), 28 + json_length
view = lambda i: data[start + gltf["bufferViews"][i]["byteOffset"]:][:gltf["bufferViews"][i]["byteLength"]]
assert len(gltf["cameras"]) == len(cameras_of_bundle) == 4
primitive = gltf["meshes"][0]["primitives"][0]


def floats(name, components):
    accessor = gltf["accessors"][primitive["attributes"][name]]
    assert accessor["componentType"] == 5126
    return list(struct.iter_unpack("<%df" % components, view(accessor["bufferView"])))


places, normals, coordinates = floats("POSITION", 3), floats("NORMAL", 3), floats("TEXCOORD_0", 2)
assert len(places) == len(normals) == len(coordinates)
assert all(abs(math.sqrt(dot(n, n)) - 1) < 1e-4 for n in normals)
assert all(0 <= c <= 1 for uv in coordinates for c in uv)
for t, n in zip(floats("TANGENT", 4), normals):
    assert abs(math.sqrt(dot(t, t)) - 1) < 1e-4 and abs(dot(t, n)) < 1e-4 and t[3] == 1
bounds = gltf["accessors"][primitive["attributes"]["POSITION"]]
assert all(bounds["min"][k] == min(p[k] for p in places) for k in range(3)), "to the last bit"
assert all(bounds["max"][k] == max(p[k] for p in places) for k in range(3))
for part in gltf["bufferViews"]:
    assert part["byteOffset"] % 4 == 0 and part["byteOffset"] + part["byteLength"] <= gltf["buffers"][0]["byteLength"]
for camera in gltf["nodes"][1:]:
    assert abs(sum(c * c for c in camera["rotation"]) - 1) < 1e-6
indices = [i for (i,) in struct.iter_unpack("<I", view(gltf["accessors"][primitive["indices"]]["bufferView"]))]
assert max(indices) < len(places) and 900 < len(indices) // 3 <= 10000, len(indices) // 3
# Metres, y up, back to LPS millimetres.
worst = max(skin.distance((1000 * x, -1000 * z, 1000 * y)) for x, y, z in places[::5])
assert worst <= 0.3, worst
for image in gltf["images"]:
    assert image["mimeType"] == "image/png" and png_size(view(image["bufferView"])) == (2048, 2048)

# OBJ: the same numbers as the GLB
obj = pathlib.Path("obj/organ.obj").read_text().split("\n")
vertices = [tuple(map(float, l.split()[1:])) for l in obj if l.startswith("v ")]
assert sum(l.startswith("vn ") for l in obj) == len(vertices)
for k in range(3):
    assert abs(min(v[k] for v in vertices) - min(p[k] for p in places)) < 1e-6
assert all(len(c.split("/")) == 3 for l in obj if l.startswith("f ") for c in l.split()[1:])
assert "map_Kd organ.png" in pathlib.Path("obj/organ.mtl").read_text()
