#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the tetrahedra of an export to MuJoCo and to gmsh and holds them against the bundle.

usage: read_solids.py BUNDLE MODEL.xml MESH.msh. The model is read by Python's XML against the names
of MuJoCo's own XML reference, the mesh by gmsh's description of MSH 2.2.
"""
import json
import pathlib
import sys
import xml.etree.ElementTree

bundle, model, mesh = map(pathlib.Path, sys.argv[1:4])
mechanics = json.loads((bundle / "mechanics.json").read_text())
solid, tissue = mechanics["tetrahedra"], mechanics["tissue"]
nodes, cells = solid["nodes_mm"], solid["corners"]
WITHIN = 1e-6


def near(a, b):
    assert len(a) == len(b)
    assert all(abs(x - y) <= WITHIN for p, q in zip(a, b) for x, y in zip(p, q))


root = xml.etree.ElementTree.parse(model).getroot()
assert root.tag == "mujoco" and float(root.find("option").get("timestep")) > 1e-5
bodies = root.findall("worldbody/body")
near([[1000 * float(x) for x in b.get("pos").split()] for b in bodies], nodes)
anchors = {i for i, b in enumerate(bodies) if b.find("joint") is None}
assert anchors == set(solid["anchors"])
for b in bodies:
    axes = [j.get("axis") for j in b.findall("joint")]
    assert axes in ([], ["1 0 0", "0 1 0", "0 0 1"]) and all(j.get("type") == "slide" for j in b.findall("joint"))
flex = root.find("deformable/flex")
assert flex.get("dim") == "3" and flex.get("body").split() == [b.get("name") for b in bodies]
assert [int(i) for i in flex.get("element").split()] == [i for c in cells for i in c]
elasticity = flex.find("elasticity")
assert abs(float(elasticity.get("young")) - 1000 * tissue["young_modulus_kpa"]) < 1e-6
assert abs(float(elasticity.get("poisson")) - solid["poisson_ratio"]) < 1e-9
masses = [float(b.find("inertial").get("mass")) for b in bodies if b.find("inertial") is not None]
assert len(masses) == len(nodes) - len(anchors) and min(masses) > 0

lines = mesh.read_text().split("\n")
assert lines[:3] == ["$MeshFormat", "2.2 0 8", "$EndMeshFormat"]
start = lines.index("$Nodes") + 1
count = int(lines[start])
rows = [line.split() for line in lines[start + 1:start + 1 + count]]
assert [int(r[0]) for r in rows] == list(range(1, count + 1))
near([[float(x) for x in r[1:]] for r in rows], nodes)
start = lines.index("$Elements") + 1
rows = [list(map(int, line.split())) for line in lines[start + 1:start + 1 + int(lines[start])]]
assert all(r[1] == 4 and r[2] == 2 for r in rows)
assert [[i - 1 for i in r[5:]] for r in rows] == cells
print("mjcf and gmsh agree with the bundle")
