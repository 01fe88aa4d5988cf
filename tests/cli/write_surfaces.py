#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces of one organ as programs write them: write_surfaces.py FOLDER. organ.ply is in the world's millimetres."""
import json
import math
import pathlib
import struct
import sys

FOLDER = pathlib.Path(sys.argv[1])
CENTRE = (13.7, -20.0, 308.75)


def ball(radius, rings=24, around=48):
    """A closed, outward ball: radius(direction) mm."""
    directions = [(0, 0, 1)]
    for r in range(1, rings):
        polar = math.pi * r / rings
        for a in range(around):
            turn = 2 * math.pi * a / around
            directions.append((math.sin(polar) * math.cos(turn), math.sin(polar) * math.sin(turn), math.cos(polar)))
    directions.append((0, 0, -1))
    faces = [(0, 1 + a, 1 + (a + 1) % around) for a in range(around)]
    for r in range(rings - 2):
        for a in range(around):
            i, j = 1 + r * around + a, 1 + r * around + (a + 1) % around
            faces += [(i, i + around, j + around), (i, j + around, j)]
    last = len(directions) - 1
    faces += [(last, last - around + (a + 1) % around, last - around + a) for a in range(around)]
    return [tuple(radius(d) * c for c in d) for d in directions], faces


def lumpy(d):
    x, y, z = d
    return 45 + 9 * x - 6 * y * z + 5 * x * y * y + 4 * z


def moved(vertices, by):
    return [tuple(c + b for c, b in zip(v, by)) for v in vertices]


def turned(vertices, axes, size=1.0):
    """axes: for each of a file's axes the world's, 1…3, with its sign; size: mm of a unit."""
    return [tuple(math.copysign(v[abs(a) - 1], v[abs(a) - 1] * a) / size for a in axes) for v in vertices]


def ply(name, vertices, faces, comment=None):
    head = ["ply", "format ascii 1.0"] + ([f"comment {comment}"] if comment else [])
    head += [f"element vertex {len(vertices)}"] + [f"property double {c}" for c in "xyz"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = ["%.9f %.9f %.9f" % v for v in vertices] + ["3 %d %d %d" % f for f in faces]
    (FOLDER / name).write_text("\n".join(head + rows) + "\n")


def obj(name, vertices, faces, comment=None):
    rows = ([f"# {comment}"] if comment else []) + ["v %.9f %.9f %.9f" % v for v in vertices]
    (FOLDER / name).write_text("\n".join(rows + ["f %d %d %d" % tuple(c + 1 for c in f) for f in faces]) + "\n")


def stl(name, vertices, faces, title):
    data = title.encode().ljust(80, b"\0") + struct.pack("<I", len(faces))
    for f in faces:
        data += struct.pack("<12fH", 0, 0, 0, *(c for v in f for c in vertices[v]), 0)
    (FOLDER / name).write_bytes(data)


def vtk(name, vertices, faces, title):
    rows = ["# vtk DataFile Version 4.2", title, "ASCII", "DATASET POLYDATA", f"POINTS {len(vertices)} double"]
    rows += ["%.9f %.9f %.9f" % v for v in vertices] + [f"POLYGONS {len(faces)} {4 * len(faces)}"] + ["3 %d %d %d" % f for f in faces]
    (FOLDER / name).write_text("\n".join(rows) + "\n")


def vtp(name, vertices, faces, space):
    letters = " ".join(str(ord(c)) for c in space) + " 0"
    array = '<DataArray type="{}" {} format="ascii">{}</DataArray>'.format
    (FOLDER / name).write_text(
        '<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian"><PolyData><FieldData>'
        f'<Array type="String" Name="SPACE" NumberOfTuples="1" format="ascii">{letters}</Array></FieldData>'
        f'<Piece NumberOfPoints="{len(vertices)}" NumberOfPolys="{len(faces)}"><Points>'
        + array("Float64", 'NumberOfComponents="3"', " ".join("%.9f %.9f %.9f" % v for v in vertices)) + "</Points><Polys>"
        + array("Int64", 'Name="connectivity"', " ".join("%d %d %d" % f for f in faces))
        + array("Int64", 'Name="offsets"', " ".join(str(3 * i + 3) for i in range(len(faces))))
        + "</Polys></Piece></PolyData></VTKFile>\n")


def glb(name, vertices, faces):
    places = b"".join(struct.pack("<3f", *v) for v in vertices)
    data = places + b"".join(struct.pack("<3I", *f) for f in faces)
    document = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}], "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(places)},
                        {"buffer": 0, "byteOffset": len(places), "byteLength": len(data) - len(places)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": len(vertices),
                       "min": [min(v[k] for v in vertices) for k in range(3)], "max": [max(v[k] for v in vertices) for k in range(3)]},
                      {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * len(faces)}]}).encode()
    document += b" " * (-len(document) % 4)
    body = struct.pack("<I4s", len(document), b"JSON") + document + struct.pack("<I4s", len(data), b"BIN\0") + data
    (FOLDER / name).write_bytes(struct.pack("<4s2I", b"glTF", 2, 12 + len(body)) + body)


RAS, Y_UP = (-1, -2, 3), (1, 3, -2)
V, F = ball(lumpy)
V = moved(V, CENTRE)
ras = turned(V, RAS)
ply("organ.ply", V, F)
ply("organ_inward.ply", V, [(a, c, b) for a, b, c in F])
obj("organ_ras.obj", ras, F, "3D Slicer output. SPACE=RAS")
ply("organ_ras.ply", ras, F, "SPACE=RAS")
stl("organ_ras.stl", ras, F, "3D Slicer output. SPACE=RAS")
vtk("organ_ras.vtk", ras, F, "3D Slicer output. SPACE=RAS")
vtp("organ_ras.vtp", ras, F, "RAS")
obj("organ_lps.obj", V, F, "3D Slicer output. SPACE=LPS")
obj("organ_las.obj", turned(V, (1, -2, 3)), [(a, c, b) for a, b, c in F], "SPACE=LAS")
obj("organ_plain_ras.obj", ras, F)
obj("organ_cm.obj", turned(V, (1, 2, 3), 10), F)
obj("organ_cm_said.obj", turned(V, (1, 2, 3), 10), F, "SPACE=LPS UNIT=cm")
obj("organ_y_up.obj", turned(V, Y_UP, 25.4), F)
glb("organ_m.glb", turned(V, Y_UP, 1000), F)
glb("organ_mm.glb", turned(V, Y_UP), F)

v, f = ball(lambda d: 30, 40, 80)
ply("two_balls.ply", v + moved(v, (30, 0, 0)), f + [tuple(c + len(v) for c in t) for t in f])
w, _ = ball(lambda d: 15, 40, 80)
ply("two_sizes.ply", v + moved(w, (80, 0, 0)), f + [tuple(c + len(v) for c in t) for t in f])

# A wavy sheet that looks up.
N = 24
sheet = [(4.0 * i, 4.0 * j, 3 * math.sin(i / 4) * math.cos(j / 5)) for j in range(N) for i in range(N)]
quads = [(j * N + i, j * N + i + 1, (j + 1) * N + i + 1, (j + 1) * N + i) for j in range(N - 1) for i in range(N - 1)]
ply("sheet.ply", sheet, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
