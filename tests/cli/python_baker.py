# SPDX-License-Identifier: GPL-3.0-or-later
# usage: python_baker.py FOLDER: tests of the module organbake against what the program wrote there.
import ast
import inspect
import json
import pathlib
import re
import subprocess
import sys
import threading
import time
import unittest
import warnings

import numpy as np
import organbake

FOLDER = pathlib.Path(sys.argv[1])
STUB = pathlib.Path(__file__).parents[2] / "apps/python/baker/organbake.pyi"


def read_ply(path):
    data = path.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    header = data[:end].decode().split("\n")
    counts = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element")}
    kinds = {"double": "<f8", "float": "<f4", "uchar": "u1", "int": "<i4", "uint": "<u4"}
    fields = [(line.split()[2], kinds[line.split()[1]]) for line in header
              if line.startswith("property") and "list" not in line]
    vertices = np.frombuffer(data, np.dtype(fields), counts["vertex"], end)
    faces = np.frombuffer(data, np.dtype([("n", "u1"), ("i", "<i4", 3)]), counts["face"],
                          end + vertices.nbytes)
    return np.stack([vertices["x"], vertices["y"], vertices["z"]], 1), faces["i"]


def read_picture(path, width, height):
    raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", str(path), "-f", "rawvideo",
                          "-pix_fmt", "rgb24", "-"], check=True, capture_output=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(height, width, 3)


def volume_of(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def sphere_ct(radius_mm=30, spacing=(2.0, 1.5, 3.0), size=(40, 50, 26)):
    """HU that rise by 40 a millimetre towards the middle, 0 on the sphere; and its middle."""
    axes = [s * np.arange(n) for s, n in zip(spacing, size)]
    middle = np.array([a.mean() for a in axes]) + [1, -2, 0.5]
    x, y, z = (a - m for a, m in zip(axes, middle))
    r = np.sqrt(x[None, None] ** 2 + y[None, :, None] ** 2 + z[:, None, None] ** 2)
    return np.clip(40 * (radius_mm - r), -1000, 1000).astype(np.float32), spacing, middle


TRUTH = read_ply(FOLDER / "phantom/truth.ply")


class SurfaceTest(unittest.TestCase):
    def test_a_sphere(self):
        voxels, spacing, middle = sphere_ct()
        vertices, faces = organbake.surface(voxels, spacing, origin_mm=(5, 6, 7), level=0)
        off = np.linalg.norm(vertices - middle - [5, 6, 7], axis=1) - 30
        # A linear ramp is cut between voxels but for how its sphere bends within one: s²/8r.
        self.assertLess(np.abs(off).max(), 0.06)
        self.assertAlmostEqual(volume_of(vertices, faces) / (4 / 3 * np.pi * 30 ** 3), 1, delta=0.01)
        self.assertEqual((vertices.dtype, faces.dtype), (np.float64, np.uint32))

    def test_a_label_and_every_kind_of_number(self):
        voxels, spacing, middle = sphere_ct()
        mask = (voxels > 0).astype(np.uint8) * 3
        vertices, faces = organbake.surface(mask, spacing, label=3)
        # Stairs of 3 mm, blurred: the volume is kept to 0.1 % of the voxels', which err by 1 %.
        self.assertAlmostEqual(volume_of(vertices, faces) / (np.prod(spacing) * (mask > 0).sum()), 1,
                               delta=0.005)
        again = organbake.surface(mask.astype(np.int64)[::1], spacing, label=3)
        np.testing.assert_array_equal(vertices, again[0])

    def test_values_stay_what_they_are(self):
        voxels, spacing, _ = sphere_ct()
        vertices, faces = organbake.surface(voxels, spacing, level=100)
        for scale, offset in ((1e-3, 0.5), (1e6, -3e5)):
            other = organbake.surface(scale * voxels + offset, spacing, level=scale * 100 + offset)
            np.testing.assert_array_equal(faces, other[1])
            np.testing.assert_allclose(vertices, other[0], atol=1e-3)
        unmeasured = np.where(voxels < 0, np.nan, voxels)
        vertices, faces = organbake.surface(unmeasured, spacing, level=-50)
        # The rim's voxels below 0 are gone with the air: up to half a voxel of the radius.
        self.assertAlmostEqual(volume_of(vertices, faces) / (4 / 3 * np.pi * 30 ** 3), 1, delta=0.1)

    def test_axes_and_the_order_of_voxels(self):
        voxels = np.full((10, 12, 14), -1000)
        voxels[2:4, 5:9, 10:13] = 1000  # z, y, x
        vertices, _ = organbake.surface(voxels, (1, 1, 1), level=0)
        np.testing.assert_allclose(vertices.mean(0), (11, 6.5, 2.5), atol=0.1)
        turned, faces = organbake.surface(voxels, (1, 1, 1), level=0,
                                          direction=[[0, -1, 0], [1, 0, 0], [0, 0, 1]])
        np.testing.assert_allclose(turned.mean(0), (-6.5, 11, 2.5), atol=0.1)
        self.assertGreater(volume_of(turned, faces), 0)


class DecimateTest(unittest.TestCase):
    def test_is_what_the_program_makes(self):
        proxy = organbake.decimate(*TRUTH, count=80)
        vertices, faces = read_ply(FOLDER / "proxy.ply")
        np.testing.assert_array_equal(proxy.vertices_mm, vertices)
        np.testing.assert_array_equal(proxy.faces, faces)
        figures = json.loads((FOLDER / "decimate.json").read_text())["report"]["figures"]
        for name in ("rms_mm", "max_mm", "reverse_rms_mm", "reverse_max_mm", "volume_change"):
            self.assertEqual(getattr(proxy, name), figures[name], name)
        self.assertTrue(proxy.closed_manifold)
        self.assertEqual(proxy.genus, 0)

    def test_the_lock_of_the_interpreter_is_free_meanwhile(self):
        counted = [0]
        stop = threading.Event()

        def count():
            while not stop.is_set():
                counted[0] += 1
                time.sleep(0.0002)

        thread = threading.Thread(target=count)
        interval = sys.getswitchinterval()
        sys.setswitchinterval(1000)
        try:
            thread.start()
            before = counted[0]
            organbake.decimate(*TRUTH, count=80)
            self.assertGreater(counted[0], before)
        finally:
            stop.set()
            sys.setswitchinterval(interval)
            thread.join()


class CamerasTest(unittest.TestCase):
    def test_place_is_what_the_program_makes(self):
        cameras = organbake.place(*TRUTH, count=6, map_size=128)
        document = json.loads((FOLDER / "cameras/cameras.json").read_text())["cameras"]
        self.assertEqual(len(cameras), 6)
        self.assertEqual(cameras.size, 128)
        for i, camera in enumerate(document):
            pose = np.c_[camera["camera_from_world"]["rotation"],
                         camera["camera_from_world"]["translation_mm"]]
            np.testing.assert_array_equal(cameras.camera_from_world[i, :3], pose)
            np.testing.assert_array_equal(cameras.intrinsics[i],
                                          [camera[k] for k in ("fx", "fy", "cx", "cy")])

    def test_capture_puts_the_surface_into_the_maps(self):
        vertices, faces = TRUTH
        proxy = organbake.decimate(vertices, faces, count=80)
        cameras = organbake.place(vertices, faces, count=4, map_size=96)
        colors = np.tile([0.5, 0.2, 0.1], (len(vertices), 1))
        maps = organbake.capture(vertices, faces, proxy.vertices_mm, proxy.faces, cameras,
                                 colors=colors)
        self.assertEqual(len(maps), 4)
        for i, one in enumerate(maps):
            there = np.isfinite(one.depth_mm)
            self.assertGreater(there.mean(), 0.2)
            np.testing.assert_array_equal(there, one.face != 0xFFFFFFFF)
            np.testing.assert_allclose(one.color[there], np.tile([0.5, 0.2, 0.1], (there.sum(), 1)),
                                       atol=1e-3)
            # Each texel's point lies near a vertex of the surface: their edges are 2 mm.
            fx, fy, cx, cy = cameras.intrinsics[i]
            y, x = np.argwhere(there)[:: 97].T
            z = one.depth_mm[y, x].astype(float)
            camera = np.stack([(x + 0.5 - cx) / fx * z, (y + 0.5 - cy) / fy * z, z], 1)
            pose = cameras.camera_from_world[i]
            world = (camera - pose[:3, 3]) @ pose[:3, :3]
            nearest = np.linalg.norm(world[:, None] - vertices[None], axis=2).min(1)
            self.assertLess(nearest.max(), 3)


class RegisterTest(unittest.TestCase):
    def setUp(self):
        self.camera = json.loads((FOLDER / "phantom/photos/cameras.json").read_text())["cameras"][0]
        self.image = read_picture(FOLDER / "phantom/photos/photo_00.png", 320, 320)
        self.lens = [self.camera[k] for k in ("fx", "fy", "cx", "cy")]
        self.pose = np.eye(4)
        self.pose[:3, :3] = self.camera["camera_from_world"]["rotation"]
        self.pose[:3, 3] = self.camera["camera_from_world"]["translation_mm"]

    def off_mm(self, pose):
        vertices = TRUTH[0]
        return np.linalg.norm(vertices @ (pose[:3, :3] - self.pose[:3, :3]).T
                              + pose[:3, 3] - self.pose[:3, 3], axis=1).mean()

    def test_finds_a_photographs_pose(self):
        start = self.pose.copy()
        start[:3, 3] += (4, -3, 5)
        found = organbake.register(*TRUTH, self.image, self.lens, start=start)
        self.assertGreater(self.off_mm(start), 5)
        self.assertLess(self.off_mm(found.camera_from_world), 1)  # a small photo, a mesh of 2 mm
        self.assertIn(found.verdict, ("ok", "doubtful"))
        self.assertEqual(found.reason == "", found.verdict == "ok")

    def test_is_what_the_program_finds(self):
        found = organbake.register(*TRUTH, self.image, self.lens, start=self.pose)
        document = json.loads((FOLDER / "pose.json").read_text())
        camera = (document["cameras"] + document.get("left_out", []))[0]
        np.testing.assert_array_equal(found.camera_from_world[:3, :3],
                                      camera["camera_from_world"]["rotation"])
        self.assertEqual(found.verdict, camera["registration"]["verdict"])
        self.assertEqual(found.correlation, camera["registration"]["correlation"])

    def test_a_mask(self):
        mask = np.ones((320, 320), bool)
        mask[:, :160] = False
        found = organbake.register(*TRUTH, self.image, self.lens, start=self.pose, mask=mask)
        self.assertLess(found.visible_share, 0.7)


class ShadeTest(unittest.TestCase):
    def test_a_tilted_plane_under_a_lamp_at_the_lens(self):
        h, w, f = 96, 128, 120.0
        y, x = np.mgrid[:h, :w] + 0.5
        rays = np.stack([(x - w / 2) / f, (y - h / 2) / f, np.ones((h, w))], 2)
        normal = np.array([0.25, 0.1, -1]) / np.linalg.norm([0.25, 0.1, -1])
        depth = -60 / (rays @ normal)  # of the plane n·p = −60
        ranges = depth * np.linalg.norm(rays, axis=2)
        light = -(rays @ normal) / np.linalg.norm(rays, axis=2) / ranges ** 2
        srgb = 255 * np.clip(1.055 * (0.6 * light / light.max()) ** (1 / 2.4) - 0.055, 0, 1)
        image = np.repeat(srgb[..., None], 3, 2).round().astype(np.uint8)
        shaded = organbake.shade(image, (f, f, w / 2, h / 2), range_mm=float(np.median(ranges)),
                                 masks=False)
        self.assertTrue(shaded.metric)
        self.assertTrue(shaded.tissue.all())
        relative = shaded.depth / depth - 1
        self.assertLess(np.sqrt((relative ** 2).mean()), 0.02)
        self.assertGreater((shaded.normals @ normal).mean(), np.cos(np.radians(5)))
        self.assertEqual(shaded.depth.shape, (h, w))
        without = organbake.shade(image, (f, f, w / 2, h / 2), masks=False)
        self.assertFalse(without.metric)
        self.assertAlmostEqual(float(np.median(without.depth)), 1, delta=0.05)


class WrongInputTest(unittest.TestCase):
    def test_raises_and_never_crashes(self):
        v, f = TRUTH
        voxels, spacing, _ = sphere_ct()
        image = np.zeros((32, 40, 3), np.uint8)
        lens = (40, 40, 20, 16)
        bad_faces = f.copy()
        bad_faces[3, 1] = len(v)
        nan = v.copy()
        nan[7, 2] = np.nan
        calls = [
            lambda: organbake.surface("ct", spacing), lambda: organbake.surface(voxels[0], spacing),
            lambda: organbake.surface(voxels, (1, 1)), lambda: organbake.surface(voxels, (1, 1, 0)),
            lambda: organbake.surface(voxels, (1, 1, np.nan)),
            lambda: organbake.surface(voxels * np.nan, spacing),
            lambda: organbake.surface(voxels, spacing, cap="square"),
            lambda: organbake.surface(voxels.astype(complex), spacing),
            lambda: organbake.surface(np.zeros((0, 3, 3)), spacing),
            lambda: organbake.surface(voxels, spacing, level=5000),
            lambda: organbake.surface(voxels, spacing, label=9),
            lambda: organbake.surface(voxels, spacing, label=1, level=0),
            lambda: organbake.surface(voxels, spacing, direction=np.zeros((3, 3))),
            lambda: organbake.surface(voxels, spacing, direction=np.eye(2)),
            lambda: organbake.decimate(nan, f), lambda: organbake.decimate(v, bad_faces),
            lambda: organbake.decimate(v, f - 1), lambda: organbake.decimate(v, f.astype(float)),
            lambda: organbake.decimate(v, f[:0]), lambda: organbake.decimate(v[:, :2], f),
            lambda: organbake.decimate(v, f, count=0), lambda: organbake.decimate(v, f, method="best"),
            lambda: organbake.place(v, f, count=0), lambda: organbake.place(v, f, map_size=1),
            lambda: organbake.place(v, f, cone_axis=(0, 0, 0)), lambda: organbake.place(v * 0, f),
            lambda: organbake.capture(v, f, v, f, organbake.place(v, f, map_size=16), colors=v[:5]),
            lambda: organbake.capture(v, f, v, f, organbake.place(v, f, map_size=16), colors=v * 100),
            lambda: organbake.register(v, f, image[..., 0], lens),
            lambda: organbake.register(v, f, image.astype(float), lens),
            lambda: organbake.register(v, f, image, (40, 40, 20)),
            lambda: organbake.register(v, f, image, (-40, 40, 20, 16)),
            lambda: organbake.register(v, f, image, lens, start=np.eye(3)),
            lambda: organbake.register(v, f, image, lens, start=2 * np.eye(4)),
            lambda: organbake.register(v, f, image, lens, mask=np.ones((3, 3))),
            lambda: organbake.register(v, f, image, lens, light="sun"),
            lambda: organbake.register(v, f, image, lens, similarity="luck"),
            lambda: organbake.register(v, f, image, lens, similarity="silhouette"),
            lambda: organbake.shade(image[0]), lambda: organbake.shade(image, (1, 2)),
            lambda: organbake.shade(image, range_mm=-1), lambda: organbake.shade(image, texture=np.nan),
            lambda: organbake.shade(image, instruments=np.ones((2, 2))),
            lambda: organbake.shade(image, field_of_view_rad=0),
            lambda: organbake.shade(image, field_of_view_rad=70),
        ]
        for i, call in enumerate(calls):
            with self.assertRaises(ValueError, msg=inspect.getsource(call) + str(i)):
                call()
        for call in (lambda: organbake.capture(v, f, v, f, "cameras"), lambda: organbake.decimate(v),
                     lambda: organbake.decimate(v, f, 80), lambda: organbake.place(v, f, count="many")):
            with self.assertRaises(TypeError):
                call()

    def test_the_programs_sentences(self):
        voxels, spacing, _ = sphere_ct()
        with self.assertRaisesRegex(ValueError, r"the volume spans"):
            organbake.surface(voxels, spacing, level=5000)
        with self.assertRaisesRegex(ValueError, r"faces\[3\] names vertex 10242 of 10242"):
            faces = TRUTH[1].copy()
            faces[3, 1] = len(TRUTH[0])
            organbake.decimate(TRUTH[0], faces)


class ModuleTest(unittest.TestCase):
    def test_threads_work_side_by_side(self):
        expected = organbake.decimate(*TRUTH, count=100).vertices_mm
        results = [None] * 3

        def work(i):
            results[i] = organbake.decimate(*TRUTH, count=100).vertices_mm

        threads = [threading.Thread(target=work, args=(i,)) for i in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for result in results:
            np.testing.assert_array_equal(result, expected)

    def test_says_what_it_does_and_the_stub_knows_all(self):
        stub = STUB.read_text()
        for name, member in vars(organbake).items():
            if name.startswith("_"):
                continue
            self.assertTrue(inspect.getdoc(member), name)
            self.assertIn(name, stub)
            for attribute in vars(member) if inspect.isclass(member) else ():
                if not attribute.startswith("_"):
                    self.assertIn(f"{attribute}: Final", stub, name)

    def test_the_stub_has_the_functions_arguments(self):
        for node in ast.parse(STUB.read_text()).body:
            if isinstance(node, ast.FunctionDef):
                told = getattr(organbake, node.name).__doc__.split(" -> ")[0]
                self.assertEqual([a.arg for a in node.args.args + node.args.kwonlyargs],
                                 re.findall(r"(\w+): ", told), node.name)


if __name__ == "__main__":
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        unittest.main(argv=sys.argv[:1], verbosity=1)
