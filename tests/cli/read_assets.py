#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the exports for physics engines and holds them against the bundle.

usage: read_assets.py BUNDLE USD_FOLDER SOFA_FOLDER [RECORDING.npz]. Debian has neither USD nor SOFA:
usda is read here by its grammar, the scene by Python's XML. Schemas and attributes are those of the
proposal's own document (OpenUSD-proposals 111, wp_deformable_physics.md). A recording's vertices_mm,
nodes_mm: what the layer's time samples must be. Ends with an AssertionError at the first thing that
is wrong.
"""
import json
import pathlib
import re
import struct
import sys
import xml.etree.ElementTree

TOKEN = re.compile(r'\s*(?:#[^\n]*\n\s*)*("(?:[^"\\]|\\.)*"|@[^@]*@|<[^>]*>|[-+]?(?:\d+\.?\d*|\.\d+)'
                   r'(?:[eE][-+]?\d+)?|[A-Za-z_][\w:.]*|[(){}\[\]=,:])')


class Usda:
    """The prims of a layer: {path: {"type", "schemas", "values", "metadata"}}."""

    def __init__(self, text):
        assert text.startswith("#usda 1.0\n")
        self.tokens, at = [], len("#usda 1.0\n")
        while text[at:].strip():
            match = TOKEN.match(text, at)
            assert match, text[at:at + 60]
            self.tokens.append(match.group(1))
            at = match.end()
        self.at, self.prims = 0, {}
        self.metadata = self.parentheses() if self.peek() == "(" else {}
        while self.peek():
            self.prim("")

    def peek(self):
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    def take(self, wanted=None):
        token = self.tokens[self.at]
        assert wanted in (None, token), f"{token}, not {wanted}"
        self.at += 1
        return token

    def value(self):
        token = self.take()
        if token in "([":
            items, end = [], ")" if token == "(" else "]"
            while self.peek() != end:
                items.append(self.value())
                if self.peek() == ",":
                    self.take()
            self.take()
            return items
        if token[0] in "\"@<":
            return token[1:-1]
        if token == "{":  # time samples
            found = {}
            while self.peek() != "}":
                time = self.value()
                self.take(":")
                found[time] = self.value()
                if self.peek() == ",":
                    self.take()
            self.take()
            return found
        try:
            return float(token)
        except ValueError:
            return token

    def parentheses(self):
        found = {}
        self.take("(")
        while self.peek() != ")":
            name = self.take()
            if name == "prepend":
                name = self.take()
            self.take("=")
            found[name] = self.value()
        self.take()
        return found

    def prim(self, parent):
        self.take("def")
        kind, name = self.take(), self.value()
        path = f"{parent}/{name}"
        prim = {"type": kind, "values": {}, "schemas": [], "parent": parent}
        assert path not in self.prims
        self.prims[path] = prim
        if self.peek() == "(":
            prim["schemas"] = self.parentheses().get("apiSchemas", [])
        self.take("{")
        while self.peek() != "}":
            if self.peek() == "def":
                self.prim(path)
                continue
            words = []  # a type and a name; `token outputs:surface` has no value
            while self.peek() != "=" and sum(w not in ("uniform", "[", "]") for w in words) < 2:
                words.append(self.take())
            if self.peek() == "=":
                self.take()
                prim["values"][words[-1]] = self.value()
                if self.peek() == "(":
                    self.parentheses()
        self.take()


def ply_vertices(path):
    data = pathlib.Path(path).read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode()
    assert "binary_little_endian" in header
    count = int(re.search(r"element vertex (\d+)", header).group(1))
    kinds = re.findall(r"property (\w+) \w+", header[:header.index("element face")])
    form = "<" + "".join({"double": "d", "float": "f", "uchar": "B"}[k] for k in kinds)
    return [struct.unpack_from(form, data, end + i * struct.calcsize(form))[:3] for i in range(count)]


def scene(p):
    return (p[0] / 1000, p[2] / 1000, -p[1] / 1000)


def near(a, b, within, what):
    a, b = list(a), list(b)
    assert len(a) == len(b), f"{what}: {len(a)} numbers for {len(b)}"
    for i, (x, y) in enumerate(zip(a, b)):
        assert abs(x - y) <= within, f"{what}[{i}]: {x} for {y}"


def flat(rows):
    return [x for row in rows for x in row]


bundle, usd, sofa = map(pathlib.Path, sys.argv[1:4])
mechanics = json.loads((bundle / "mechanics.json").read_text())
proxy = [scene(p) for p in ply_vertices(bundle / "proxy.ply")]
solid = mechanics.get("tetrahedra")
RELATIVE, METRES = 1e-6, 1e-6

layer = Usda((usd / "organ.usda").read_text())
assert layer.metadata["metersPerUnit"] == 1 and layer.metadata["upAxis"] == "Y"
assert layer.metadata["defaultPrim"] == "Organ" and layer.prims["/Organ"]["type"] == "Xform"
mesh = layer.prims["/Organ/Proxy"]["values"]
near(flat(mesh["points"]), flat(proxy), METRES, "usd: proxy")
for got, wanted in zip(mesh["organbake:masses"], mechanics["mass_kg"], strict=True):
    assert abs(got - wanted) <= RELATIVE * wanted
assert mesh["organbake:anchors"] == mechanics["anchors"]
assert max(mesh["faceVertexIndices"]) == len(proxy) - 1
assert sum(mesh["faceVertexCounts"]) == len(mesh["faceVertexIndices"])
assert len(mesh["organbake:springs"]) == len(mesh["organbake:springStiffnesses"])
surface = layer.prims["/Organ/Surface"]["values"]
assert len(surface["primvars:st:indices"]) == len(surface["faceVertexIndices"])
assert max(surface["primvars:st:indices"]) < len(surface["primvars:st"])
assert max(surface["faceVertexIndices"]) == len(surface["points"]) - 1
assert layer.prims[surface["material:binding"]]["type"] == "Material"
low, high = surface["extent"]
for p in surface["points"]:
    assert all(l <= x <= h for l, x, h in zip(low, p, high))
for name, prim in layer.prims.items():
    for key, value in prim["values"].items():
        if key.endswith(".connect"):
            assert value.split(".")[0] in layer.prims, f"{name}: {key} leads to nothing"
        if key == "inputs:file":
            assert (usd / value).is_file(), value
material = layer.prims["/Organ/Tissue"]["values"]
tissue = mechanics["tissue"]
for name, wanted in (("density", tissue["density_kg_per_m3"]), ("youngsModulus", 1000 * tissue["young_modulus_kpa"])):
    assert abs(material["physics:" + name] - wanted) <= 1e-6 * wanted, name
assert ("/Organ/Body" in layer.prims) == (solid is not None)

# What the proposal asks of a deformable body: its root, one simulated geometry right below it, and
# all that follows it tied by a bind pose of as many points.
assert layer.prims["/Organ"]["schemas"] == ["PhysicsDeformableBodyAPI"]
simulated = [p for p in layer.prims.values() if any(s.endswith("DeformableSimAPI") for s in p["schemas"])]
assert len(simulated) == 1 and simulated[0]["parent"] == "/Organ"
assert simulated[0]["values"]["material:binding:physics"] == "/Organ/Tissue"
sim_masses = simulated[0]["values"]["physics:masses"]
assert len(sim_masses) == len(simulated[0]["values"]["points"]) and min(sim_masses) > 0
root_mass = layer.prims["/Organ"]["values"]["physics:mass"]
assert abs(sum(sim_masses) - root_mass) <= 1e-6 * root_mass
assert "PhysicsCollisionAPI" in layer.prims["/Organ/Proxy"]["schemas"]
for name in ("Surface", "Proxy") + (("Body",) if solid else ()):
    prim = layer.prims["/Organ/" + name]
    assert "PhysicsDeformablePoseAPI:bind" in prim["schemas"], name
    assert prim["values"]["physics:deformablePose:bind:purposes"] == ["bindPose"]
    assert prim["values"]["physics:deformablePose:bind:points"] == prim["values"]["points"]
assert not any("Omni" in s for p in layer.prims.values() for s in p["schemas"])

if len(sys.argv) > 4:
    import numpy
    recording = numpy.load(sys.argv[4])
    frames = len(recording["vertices_mm"])
    assert layer.metadata["startTimeCode"] == 0 and layer.metadata["endTimeCode"] == frames - 1
    assert abs(layer.metadata["timeCodesPerSecond"] * float(recording["time_step_s"]) - 1) < 1e-6
    largest = 0
    for name, key in (("Proxy", "vertices_mm"), ("Body", "nodes_mm")):
        if "/Organ/" + name not in layer.prims or key not in recording:
            continue
        samples = layer.prims["/Organ/" + name]["values"]["points.timeSamples"]
        assert sorted(samples) == list(range(frames))
        got = numpy.array([samples[f] for f in range(frames)])
        world = 1000 * numpy.stack([got[..., 0], -got[..., 2], got[..., 1]], axis=-1)
        assert world.shape == recording[key].shape
        largest = max(largest, numpy.abs(world - recording[key]).max())
    assert 0 < largest <= 1.1e-6, f"time samples are {largest} mm off"
    skin = layer.prims["/Organ/Surface"]["values"]
    assert len(skin["points.timeSamples"]) == len(skin["normals.timeSamples"]) == frames
    moved = numpy.abs(numpy.array(skin["points.timeSamples"][frames - 1]) - numpy.array(skin["points"])).max()
    assert moved > 1e-3, "the surface did not move"
    print(f"{frames} time samples, at most {largest:.2e} mm off the recording")

scene_file = xml.etree.ElementTree.parse(sofa / "organ.scn").getroot()
organ = scene_file.find("Node[@name='Organ']")
numbers = lambda text: [float(x) for x in text.split()]
masses = numbers(organ.find("DiagonalMass").get("vertexMass"))
anchored = [int(i) for i in organ.find("FixedProjectiveConstraint").get("indices").split()]
near(numbers(organ.find("Node[@name='Collision']/MeshTopology").get("position")), flat(proxy), METRES, "sofa: proxy")
assert (sofa / organ.find("Node[@name='Visual']/MeshOBJLoader").get("filename")).is_file()
assert (sofa / organ.find("Node[@name='Visual']/OglModel").get("texturename")).is_file()

if solid is None:
    assert "PhysicsSurfaceDeformableSimAPI" in layer.prims["/Organ/Proxy"]["schemas"]
    assert mesh["physics:restTriVertexIndices"] == [[float(i) for i in mesh["faceVertexIndices"][f:f + 3]] for f in range(0, len(mesh["faceVertexIndices"]), 3)]
    near(masses, mechanics["mass_kg"], 1e-9, "sofa: masses")
    assert anchored == mechanics["anchors"]
    springs = numbers(organ.find("StiffSpringForceField").get("spring"))
    assert len(springs) == 5 * len(mesh["organbake:springs"])
    lengths = [sum((a - b) ** 2 for a, b in zip(proxy[int(s)], proxy[int(e)])) ** 0.5
               for s, e in mesh["organbake:springs"]]
    near(springs[4::5], lengths, METRES, "sofa: rest lengths")
    near(mesh["organbake:springRestLengths"], lengths, METRES, "usd: rest lengths")
else:
    nodes = [scene(p) for p in solid["nodes_mm"]]
    cells = solid["corners"]
    body = layer.prims["/Organ/Body"]
    assert body["type"] == "TetMesh" and "PhysicsVolumeDeformableSimAPI" in body["schemas"]
    assert "PhysicsVolumeDeformableMaterialAPI" in layer.prims["/Organ/Tissue"]["schemas"]
    assert abs(material["physics:poissonsRatio"] - solid["poisson_ratio"]) < 1e-6
    assert body["values"]["physics:restTetVertexIndices"] == body["values"]["tetVertexIndices"]
    assert body["values"]["physics:restShapePoints"] == body["values"]["points"]
    near(flat(body["values"]["points"]), flat(nodes), METRES, "usd: nodes")
    assert body["values"]["tetVertexIndices"] == [[float(i) for i in c] for c in cells]
    topology = organ.find("TetrahedronSetTopologyContainer")
    near(numbers(topology.get("position")), flat(nodes), METRES, "sofa: nodes")
    assert [int(i) for i in topology.get("tetrahedra").split()] == flat(cells)
    fills = body["values"]["organbake:fills"]
    mass = 0
    for c, fill in zip(cells, fills, strict=True):
        a, b, d, e = (nodes[i] for i in c)
        u, v, w = ([x - y for x, y in zip(p, a)] for p in (b, d, e))
        volume = (u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0])
                  + u[2] * (v[0] * w[1] - v[1] * w[0])) / 6
        assert volume > 0, "a tetrahedron is inside out"
        mass += volume * fill * mechanics["tissue"]["density_kg_per_m3"]
    for total in (sum(masses), sum(body["values"]["organbake:masses"]), sum(body["values"]["physics:masses"]), root_mass):
        assert abs(total - mass) <= RELATIVE * mass, f"{total} kg for {mass}"
    where = [[sum(w * nodes[n][k] for w, n in zip(weights, cells[int(t)])) for k in range(3)]
             for t, weights in zip(mesh["organbake:embeddingTetrahedra"], mesh["organbake:embeddingWeights"], strict=True)]
    near(flat(where), flat(proxy), METRES, "usd: the embedded proxy")
print("usd and sofa agree with the bundle")
