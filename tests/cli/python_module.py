# SPDX-License-Identifier: GPL-3.0-or-later
# usage: python_module.py BUNDLE ORGANPLAY: tests of the package organplay against the program.
import gc
import inspect
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import organplay

BUNDLE, PROGRAM = sys.argv[1], sys.argv[2]
EXAMPLES = pathlib.Path(__file__).parents[2] / "apps/python/examples"
STUB = pathlib.Path(__file__).parents[2] / "apps/python/package/__init__.pyi"


def resident_kb():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize() // 1024


class OfAnotherLibrary:
    """What is no array, but tells of its memory by DLPack."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


class PlayerTest(unittest.TestCase):
    def setUp(self):
        self.player = organplay.Player(BUNDLE)
        self.view = self.player.orbit(0.2, 0.1, width=160, height=120)
        # From aside, or the tool would hide all that it touches.
        self.out = self.view.camera_from_world[0, :3] - self.view.camera_from_world[2, :3]
        self.out /= np.linalg.norm(self.out)
        self.skin = np.array(self.player.skin_point(self.out))

    def poke(self, depth_mm, steps=10):
        for i in range(steps):
            step = self.player.step([self.skin + (5 - depth_mm * (i + 1) / steps) * self.out])
        return step

    def test_draws_what_the_program_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "p.png")
            subprocess.run([PROGRAM, BUNDLE, "-o", file, "--view", "0.2,0.1", "--size", "160x120",
                            "--quiet"], check=True, stdout=subprocess.DEVNULL)
            ppm = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", file, "-f", "rawvideo",
                                  "-pix_fmt", "rgb24", "-"], check=True, capture_output=True)
            expected = np.frombuffer(ppm.stdout, np.uint8).reshape(120, 160, 3)
            np.testing.assert_array_equal(self.player.draw(self.view).rgb, expected)

    def test_layers_have_their_shapes_and_units(self):
        self.poke(4)
        first = self.player.draw(self.view, "all")
        self.assertIsNone(first.flow_back)
        self.poke(6)
        picture = self.player.draw(self.view, "all")
        self.assertEqual(picture.rgb.shape, (120, 160, 3))
        self.assertEqual(picture.depth_mm.dtype, np.float32)
        self.assertEqual(picture.normals.shape, (120, 160, 3))
        self.assertEqual(picture.flow_back.shape, (120, 160, 2))
        self.assertEqual(picture.flow_back_seen.dtype, np.bool_)
        self.assertEqual(set(np.unique(picture.mask)), {0, 1, 101})
        np.testing.assert_array_equal(np.isinf(picture.depth_mm), picture.mask == 0)
        skin = picture.mask == 1
        self.assertTrue((picture.skin["face"][skin] != 0xFFFFFFFF).all())
        np.testing.assert_allclose(np.linalg.norm(picture.normals[skin], axis=1), 1, atol=1e-5)
        self.assertTrue((picture.weight >= 0).all() and (picture.weight <= 1.0001).all())
        self.assertGreater(np.abs(picture.flow_back[skin]).max(), 0.1)
        # A point's place from its depth projects to its pixel.
        fx, fy, cx, cy = self.view.intrinsics
        y, x = np.argwhere(picture.mask == 101)[0]
        ray = np.array([(x + 0.5 - cx) / fx, (y + 0.5 - cy) / fy, 1]) * picture.depth_mm[y, x]
        pose = self.view.camera_from_world
        world = pose[:, :3].T @ (ray - pose[:, 3])
        self.assertLess(np.linalg.norm(world - self.skin), 100)

    def test_only_what_is_asked_for(self):
        picture = self.player.draw(self.view, "depth")
        for other in ("normals", "mask", "skin", "organ", "weight", "flow_back", "flow_from_last"):
            self.assertIsNone(getattr(picture, other), other)

    def test_arrays_outlive_picture_and_player(self):
        depth = self.player.draw(self.view, "depth").depth_mm
        rgb = self.player.draw(self.view).rgb
        kept = depth.copy(), rgb.copy()
        self.player.close()
        del self.player
        gc.collect()
        other = organplay.Player(BUNDLE)
        other.draw(other.orbit(2.0, width=160, height=120), "all")
        np.testing.assert_array_equal(depth, kept[0])
        np.testing.assert_array_equal(rgb, kept[1])

    def test_draws_into_the_callers_memory(self):
        out = np.zeros((120, 160, 3), np.uint8)
        picture = self.player.draw(self.view, out=out)
        self.assertIs(picture.rgb, out)
        np.testing.assert_array_equal(out, self.player.draw(self.view).rgb)
        frozen = out.copy()
        frozen.flags.writeable = False
        for wrong in (out[:, ::2], out.astype(np.float32), out[0], frozen, "memory",
                      np.zeros((120, 160, 4), np.uint8)[..., :3]):
            with self.assertRaisesRegex(ValueError, "out must be"):
                self.player.draw(self.view, out=wrong)

    def test_forces_push_back(self):
        self.assertEqual(np.abs(self.player.step([self.skin + 50 * self.out]).forces_n).max(), 0)
        step = self.poke(6)
        self.assertGreater(step.forces_n[0] @ self.out, 0)
        self.assertGreater(step.contacts, 0)
        points = step.contact_points
        self.assertEqual(len(points), step.contacts)
        np.testing.assert_allclose(points["force_n"].sum(0), step.forces_n[0], atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(points["normal"], axis=1), 1, atol=1e-9)
        self.assertGreater(points["depth_mm"].max(), 1)
        self.assertFalse(points["carried"].any())
        moved = self.player.proxy_mm()
        self.player.reset()
        self.assertGreater(np.abs(moved - self.player.proxy_mm()).max(), 1)
        self.assertLess(self.player.proxy_faces().max(), len(moved))

    def test_a_blade_cuts(self):
        player = organplay.Player(BUNDLE, solver="fem")
        before = player.draw(self.view).rgb
        across = np.cross(self.out, [0, 0, 1])
        for share in np.linspace(-1, 1, 30):
            player.step([self.skin + 20 * share * across - 15 * self.out],
                        axis_mm=[30 * self.out], radius_mm=0.4, cuts=True)
        for _ in range(8):
            player.step()
        faces = player.proxy_faces()
        self.assertGreater(len(faces), len(self.player.proxy_faces()))
        self.assertLess(faces.max(), len(player.proxy_mm()))
        self.assertFalse((player.draw(self.view).rgb == before).all())
        with self.assertRaisesRegex(ValueError, "has been cut"):
            player.draw(self.view, "depth")
        player.reset()
        np.testing.assert_array_equal(player.draw(self.view).rgb, before)
        with self.assertRaisesRegex(ValueError, "solver fem"):
            organplay.Player(BUNDLE, solver="springs").step(
                [self.skin], axis_mm=[30 * self.out], cuts=True)
        with self.assertRaisesRegex(ValueError, "more than one of grabs, cuts, snips and pierces"):
            player.step([self.skin], axis_mm=[30 * self.out], cuts=True, grabs=True)

    def test_scissors_and_a_hook_cut(self):
        player = organplay.Player(BUNDLE, solver="fem")
        across = np.cross(self.out, [0, 0, 1])
        whole = len(player.proxy_faces())
        for opening in np.linspace(30, 0, 20):
            player.step([self.skin + 20 * across], axis_mm=[-40 * across + 2 * self.out],
                        radius_mm=1, snips=True, opening_mm=[opening * self.out])
        for share in np.linspace(-1, 1, 30):
            player.step([self.skin + 15 * share * np.array([0, 0, 1]) - 10 * self.out],
                        axis_mm=[30 * self.out], radius_mm=0.4, cuts=True, cut_width_mm=1.5)
        for _ in range(12):
            player.step()
        self.assertGreater(len(player.proxy_faces()), whole + 100)
        for height in np.linspace(3, -10, 30):
            step = player.step([self.skin + 30 * across + height * self.out],
                               axis_mm=[60 * self.out], radius_mm=0.6, pierces=True)
        self.assertEqual(len(step.forces_n), 1)
        with self.assertRaisesRegex(ValueError, "opening_mm"):
            player.step([self.skin], axis_mm=[30 * self.out], snips=True,
                        opening_mm=[[1, 2, 3], [1, 2, 3]])
        with self.assertRaisesRegex(ValueError, "10"):
            player.step([self.skin], axis_mm=[30 * self.out], cuts=True, cut_width_mm=11)

    def test_wrong_input_raises_and_never_crashes(self):
        p = self.player
        calls = [
            lambda: p.step("tip"), lambda: p.step([["a", "b", "c"]]), lambda: p.step([1, 2, 3]),
            lambda: p.step([[1, 2]]), lambda: p.step(np.zeros((2, 3, 1))), lambda: p.step(None),
            lambda: p.step(np.zeros((1, 3), complex)), lambda: p.step([[np.nan, 0, 0]]),
            lambda: p.step([[np.inf, 0, 0]]), lambda: p.step([[1e300, 0, 0]]),
            lambda: p.step([[0, 0, 0]], radius_mm=-1), lambda: p.step([[0, 0, 0]], radius_mm=np.nan),
            lambda: p.step([[0, 0, 0]], radius_mm=[1, 2]), lambda: p.step([[0, 0, 0]], grabs="yes"),
            lambda: p.step([[0, 0, 0]], axis_mm=[[0, 0, np.nan]]),
            lambda: p.step([[0, 0, 0]], axis_mm=[[0, 0, 1], [0, 0, 1]]),
            lambda: p.step(np.array([[object()] * 3])), lambda: p.step([[1, 2, 3], [4, 5]]),
            lambda: p.step({"a": 1}), lambda: p.draw(self.view, "deep"), lambda: p.draw(self.view, ","),
            lambda: p.orbit(np.nan), lambda: p.orbit(width=0), lambda: p.orbit(width=-5),
            lambda: p.orbit(distance=0), lambda: p.orbit(distance=np.inf),
            lambda: p.draw(p.orbit(width=100000)), lambda: p.proxy_mm(1), lambda: p.proxy_faces(7),
            lambda: p.skin_point([0, 0, 0]), lambda: p.skin_point([np.nan, 0, 1]),
            lambda: p.skin_point([1, 2]),
            lambda: organplay.View(10, 10, 5, 5, camera_from_world=np.eye(3)),
            lambda: organplay.View(10, 10, 5, 5, camera_from_world=2 * np.eye(4)),
            lambda: organplay.View(10, 10, 5, 5, camera_from_world=np.full((3, 4), np.nan)),
            lambda: organplay.View(10, 10, -5, 5, camera_from_world=np.eye(4)),
            lambda: organplay.View(10, 10, np.nan, 5, camera_from_world=np.eye(4)),
            lambda: organplay.View(10, 10, 5, 5, camera_from_world=np.eye(4), near_mm=0),
            lambda: organplay.View.look_at([0, 0, 0], [0, 0, 0]),
            lambda: organplay.View.look_at([0, 0, 0], [0, 0, np.inf]),
            lambda: organplay.Player([]), lambda: organplay.Player(7),
            lambda: organplay.Player(BUNDLE, solver="water"), lambda: organplay.Player(BUNDLE, light="sun"),
            lambda: organplay.Player(BUNDLE, time_step_s=0), lambda: organplay.Player(BUNDLE, time_step_s=np.nan),
        ]
        for i, call in enumerate(calls):
            with self.assertRaises(ValueError, msg=inspect.getsource(call) + str(i)):
                call()
        for call in (lambda: p.draw(None), lambda: p.draw(self.view, 7), lambda: p.proxy_mm(-1),
                     lambda: p.orbit("a")):
            with self.assertRaises(TypeError):
                call()
        self.assertEqual(self.player.draw(self.view).rgb.shape, (120, 160, 3))  # alive and well

    def test_files_raise_as_the_program_says(self):
        with self.assertRaises(OSError) as missing:
            organplay.Player("nowhere")
        said = subprocess.run([PROGRAM, "nowhere", "-o", "x.png"], capture_output=True, text=True)
        self.assertEqual("organplay: error: " + str(missing.exception), said.stderr.strip())
        with tempfile.TemporaryDirectory() as folder:
            broken = os.path.join(folder, "b")
            shutil.copytree(BUNDLE, broken)
            with open(os.path.join(broken, "proxy.ply"), "ab") as file:
                file.write(b"more")
            with self.assertRaisesRegex(ValueError, "proxy.ply"):
                organplay.Player(broken)

    def test_a_bundle_that_goes_away(self):
        with tempfile.TemporaryDirectory() as folder:
            bundle = os.path.join(folder, "b")
            shutil.copytree(BUNDLE, bundle)
            player = organplay.Player(bundle)
            shutil.rmtree(bundle)
            with self.assertRaisesRegex(ValueError, "is missing"):  # of what a bundle lists
                player.draw(player.orbit(width=32, height=32))
            player.step()
        self.player.close()
        for call in (self.player.step, self.player.reset, self.player.proxy_mm, self.player.orbit,
                     lambda: self.player.draw(self.view), lambda: self.player.organ_count):
            with self.assertRaisesRegex(ValueError, "closed"):
                call()
        self.player.close()  # once more does no harm

    def test_two_threads_on_one_player(self):
        failures = []

        def work(which):
            try:
                for i in range(60):
                    self.player.step([self.skin + (5 - 0.05 * i) * self.out])
                    picture = self.player.draw(self.view, "all" if which else "depth,flow")
                    if picture.rgb.shape != (120, 160, 3):
                        failures.append("shape")
            except Exception as error:  # noqa: BLE001
                failures.append(error)

        threads = [threading.Thread(target=work, args=(i,)) for i in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])

    def test_the_lock_of_the_interpreter_is_free_meanwhile(self):
        counted = [0]
        stop = threading.Event()

        def count():
            while not stop.is_set():
                counted[0] += 1
                time.sleep(0.0002)  # gives the lock away, and takes it when it can

        thread = threading.Thread(target=count)
        large = self.player.orbit(width=1600, height=1200)
        self.player.draw(large)
        interval = sys.getswitchinterval()
        sys.setswitchinterval(1000)  # nobody hands the lock over but who gives it away
        try:
            thread.start()
            before = counted[0]
            for i in range(5):
                self.player.draw(self.player.orbit(0.1 * i, width=1600, height=1200))
            self.assertGreater(counted[0], before)
        finally:
            stop.set()
            sys.setswitchinterval(interval)
            thread.join()

    def test_nothing_leaks(self):
        small = self.player.orbit(width=32, height=24)
        tip = np.array([self.skin + 4 * self.out])

        def run(steps):
            for i in range(steps):
                self.player.step(tip)
                if i % 50 == 0:
                    self.player.draw(small, "all")
                if i % 500 == 0:
                    try:
                        self.player.step([[np.nan, 0, 0]])
                    except ValueError:
                        pass

        run(5000)  # what is kept for its memory
        gc.collect()
        before = resident_kb()
        run(100000)
        gc.collect()
        self.assertLess(resident_kb() - before, 4096)  # 42 bytes a step

    def test_set_states_are_drawn_as_steps_are(self):
        own = organplay.Player(BUNDLE)
        self.player.draw(self.view, "all")
        own.draw(self.view, "all")
        for depth in (3, 6):
            own.step([self.skin + (5 - depth) * self.out])
            positions = own.proxy_mm()
            self.player.set_vertices(positions)
            self.player.place_tools([self.skin + (5 - depth) * self.out])
            for light in ("all", "depth,flow"):
                mine, theirs = self.player.draw(self.view, light), own.draw(self.view, light)
                for layer in ("rgb", "depth_mm", "normals", "mask", "weight", "flow_back",
                              "flow_back_seen", "flow_from_last", "flow_from_last_seen"):
                    one, other = getattr(mine, layer), getattr(theirs, layer)
                    self.assertEqual(one is None, other is None, layer)
                    if one is not None:
                        np.testing.assert_array_equal(one, other, layer)
        self.player.step()  # goes on from there
        self.assertLess(np.abs(self.player.proxy_mm() - positions).max(), 6)

    def test_the_mesh_is_what_the_player_carries(self):
        mesh = self.player.mesh()
        np.testing.assert_array_equal(mesh.vertices_mm, self.player.proxy_mm())
        np.testing.assert_array_equal(mesh.faces, self.player.proxy_faces())
        corners = mesh.nodes_mm[mesh.tetrahedra[mesh.vertex_tetrahedron]]
        carried = (mesh.vertex_weights[:, :, None] * corners).sum(1)
        np.testing.assert_allclose(carried, mesh.vertices_mm, atol=1e-6)
        edges = [mesh.nodes_mm[mesh.tetrahedra[:, k]] - mesh.nodes_mm[mesh.tetrahedra[:, 0]] for k in (1, 2, 3)]
        volume = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2]) / 6
        self.assertGreater(volume.min(), 0)
        np.testing.assert_allclose(mesh.node_mass_kg.sum(),
                                   (volume * mesh.fill).sum() * mesh.density_kg_per_m3 * 1e-9)
        weights = np.add.reduceat(mesh.skin_weights, mesh.skin_first[:-1])
        np.testing.assert_allclose(weights, 1, atol=1e-9)
        self.assertLess(mesh.skin_faces.max(), len(mesh.skin_first) - 1)
        moved = mesh.nodes_mm + np.array([5.0, 0, 0])
        self.player.set_nodes(moved)
        np.testing.assert_allclose(self.player.proxy_mm(), mesh.vertices_mm + [5, 0, 0], atol=1e-9)

    def test_many_are_drawn_as_one_by_one(self):
        rest = self.player.mesh().vertices_mm
        states = np.stack([rest + 2 * np.sin(rest / 20 + i) for i in range(5)])
        views = [self.player.orbit(0.2 * i, 0.1, width=48, height=40) for i in range(5)]
        many = self.player.draw_many(states, views, "depth,normals,mask,flow")
        np.testing.assert_array_equal(self.player.proxy_mm(), rest)
        other = organplay.Player(BUNDLE)
        for i, (state, view) in enumerate(zip(states, views)):
            other.set_vertices(state)
            one = other.draw(view, "depth,normals,mask,flow")
            for layer in ("rgb", "depth_mm", "normals", "mask") + (("flow_back", "flow_back_seen") if i else ()):
                np.testing.assert_array_equal(getattr(many, layer)[i], getattr(one, layer), layer)
        self.assertTrue((many.flow_back[0] == 0).all())
        plain = self.player.draw_many(states.astype(np.float32), views[0])
        self.assertIsNone(plain.depth_mm)
        self.assertEqual(plain.rgb.shape, (5, 40, 48, 3))
        nodes = np.repeat(self.player.mesh().nodes_mm[None], 2, 0)
        same = self.player.draw_many(nodes, views[1], nodes=True).rgb
        np.testing.assert_array_equal(same[0], same[1])
        two = organplay.Player([BUNDLE, BUNDLE])
        np.testing.assert_array_equal(two.draw_many(states, views, organ=1).rgb, many.rgb)
        for wrong in (lambda: self.player.draw_many(states[:, 1:].copy(), views),
                      lambda: self.player.draw_many(states, views[:2]),
                      lambda: self.player.draw_many(states, []),
                      lambda: self.player.draw_many(states, views, "id"),
                      lambda: self.player.draw_many(states, views, organ=1),
                      lambda: self.player.draw_many(states[0], views),
                      lambda: self.player.draw_many(states * np.nan, views)):
            with self.assertRaises(ValueError):
                wrong()

    def test_states_that_cannot_be_are_refused(self):
        good = self.player.proxy_mm() + 1
        self.player.set_vertices(good)
        bad = good.copy()
        bad[3, 1] = np.nan
        for state, words in ((bad, "number 3 is not finite"), (good[:-1].copy(), "for an organ of"),
                             (good / 1000, "in metres"), (good[:, :2].copy(), "shape"),
                             (good.T, "shape"), (good * [-1, 1, 1], "mirror image"),
                             (good.astype(int), "holds int64"), (good.tolist(), "must be"),
                             (good[::-1] * 9, "ti|span|another"), (None, "must be")):
            with self.assertRaisesRegex(ValueError, words):
                self.player.set_vertices(state)
            np.testing.assert_array_equal(self.player.proxy_mm(), good)
        with self.assertRaisesRegex(ValueError, "nodes for an organ"):
            self.player.set_nodes(good[:-1].copy())
        with self.assertRaisesRegex(ValueError, "no organ 1"):
            self.player.set_vertices(good, organ=1)

    def test_states_come_in_any_strides(self):
        rest = self.player.proxy_mm()
        good = rest + 1
        twice = np.repeat(good, 2, axis=0)
        for state in (np.asfortranarray(good), twice[::2], good[::-1][::-1], memoryview(good),
                      OfAnotherLibrary(good)):
            self.player.set_vertices(rest)
            self.player.set_vertices(state)
            np.testing.assert_array_equal(self.player.proxy_mm(), good)
        states = np.stack([rest, good], axis=2).transpose(2, 0, 1).astype(np.float32)
        self.assertFalse(states.flags.c_contiguous)
        np.testing.assert_array_equal(self.player.draw_many(states, self.view).rgb,
                                      self.player.draw_many(states.copy(), self.view).rgb)

    def test_arrays_are_shared_by_dlpack(self):
        picture = self.player.draw(self.view, "depth,mask,normals")
        for array in (picture.rgb, picture.depth_mm, picture.mask, picture.normals):
            other = np.from_dlpack(OfAnotherLibrary(array))
            self.assertEqual(other.ctypes.data, array.ctypes.data)
            np.testing.assert_array_equal(other, array)

    def test_a_saved_state_goes_on_to_the_byte(self):
        self.poke(4)
        saved = self.player.save_state()
        self.assertEqual(saved.steps, 10)

        def go_on():
            forces = [self.player.step([self.skin + i * self.out]).forces_n for i in range(5)]
            return np.array(forces), self.player.proxy_mm(), self.player.draw(self.view).rgb

        first = go_on()
        self.player.reset()
        self.player.restore_state(saved)
        for one, other in zip(first, go_on()):
            np.testing.assert_array_equal(one, other)
        with self.assertRaises(ValueError):
            organplay.Player(BUNDLE).restore_state(saved)

    def test_draws_as_a_scope_and_two_eyes_see(self):
        with tempfile.TemporaryDirectory() as folder:
            lens = pathlib.Path(folder, "lens.json")
            lens.write_text('{"width": 160, "height": 120, "fx": 150, "fy": 150, "cx": 80, "cy": 60,'
                            '"distortion_k1_k2_p1_p2_k3": [-0.2, 0, 0, 0, 0],'
                            '"vignette_exponent": 3, "picture": {"exposure": 1.5, "grain": 4}}')
            file = os.path.join(folder, "p.png")
            subprocess.run([PROGRAM, BUNDLE, "-o", file, "--view", "0.2,0.1", "--size", "160x120",
                            "--scope", str(lens), "--stereo-mm", "5", "--layers", "depth",
                            "--quiet"], check=True, stdout=subprocess.DEVNULL)
            scope = organplay.Scope(lens)
            self.assertEqual(scope.size, (160, 120))
            picture = self.player.draw(self.view, ["depth"], scope=scope, stereo_mm=5)
            for eye, name in ((picture.rgb, "p.png"), (picture.right_rgb, "p_right.png")):
                raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i",
                                      os.path.join(folder, name), "-f", "rawvideo", "-pix_fmt",
                                      "rgb24", "-"], check=True, capture_output=True).stdout
                np.testing.assert_array_equal(np.frombuffer(raw, np.uint8).reshape(120, 160, 3),
                                              eye)
            self.assertEqual(picture.depth_mm.shape, (120, 160))
            lens.write_text("{}")
            with self.assertRaisesRegex(ValueError, "lens.json"):
                organplay.Scope(lens)

    def test_exposes_as_data_sets_do(self):
        plain = self.player.draw(self.view).rgb.astype(int)
        self.assertIsNone(self.player.draw(self.view).right_rgb)
        dark = self.player.draw(self.view, gain=0.5).rgb.astype(int)
        self.assertTrue((dark <= plain).all() and dark.sum() < plain.sum())
        one, again, other = (self.player.draw(self.view, noise=5, seed=s).rgb for s in (1, 1, 2))
        np.testing.assert_array_equal(one, again)
        self.assertTrue((one != other).any())
        amid = (plain > 60) & (plain < 195)  # nothing is clipped there
        # 5, within 10 %: some thousand values; and a third of a level of rounding.
        self.assertLess(abs((one - plain)[amid].std() - 5), 0.5)
        for wrong in ({"gain": 0}, {"gain": np.nan}, {"noise": -1}, {"noise": 300},
                      {"stereo_mm": 0}, {"light": "sun"}):
            with self.assertRaises(ValueError, msg=str(wrong)):
                self.player.draw(self.view, **wrong)

    def test_many_are_drawn_into_the_callers_memory(self):
        states = np.stack([self.player.proxy_mm() + i for i in range(2)])
        first = self.player.draw_many(states, self.view, ["depth", "mask"])
        expected = first.rgb.copy(), first.depth_mm.copy()
        again = self.player.draw_many(states + 3, self.view, "depth,mask", out=first)
        self.assertIs(again.rgb, first.rgb)
        self.assertFalse((first.rgb == expected[0]).all())
        rgb = np.zeros_like(first.rgb)
        self.player.draw_many(states, self.view, out=rgb)
        np.testing.assert_array_equal(rgb, expected[0])
        for wrong in (rgb[:1], rgb.astype(float), rgb[:, ::2], "memory"):
            with self.assertRaisesRegex(ValueError, "out"):
                self.player.draw_many(states, self.view, out=wrong)

    def test_threads_and_version(self):
        one = organplay.Player(BUNDLE, threads=1)
        np.testing.assert_array_equal(one.draw(self.view).rgb, self.player.draw(self.view).rgb)
        with self.assertRaisesRegex(ValueError, "threads is 0"):
            organplay.Player(BUNDLE, threads=0)
        said = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout
        self.assertIn(organplay.__version__, said)

    def test_layers_are_names(self):
        both = self.player.draw(self.view, ["depth", "mask"])
        self.assertIsNotNone(both.depth_mm)
        self.assertIsNotNone(both.mask)
        with self.assertRaisesRegex(TypeError, 'layers is 7; it must be names, as "depth,mask"'):
            self.player.draw(self.view, 7)
        with self.assertRaisesRegex(ValueError, "layers holds 7"):
            self.player.draw(self.view, ["depth", 7])

    def test_examples_say_how_they_are_called(self):
        for example in ("poke_video", "play_trajectory", "numpy_solver", "train_press"):
            command = ["/usr/bin/python3", str(EXAMPLES / (example + ".py"))]
            helped = subprocess.run(command + ["--help"], capture_output=True, text=True)
            self.assertEqual((helped.returncode, helped.stderr), (0, ""))
            self.assertIn(example + ".py BUNDLE", helped.stdout)
            alone = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(alone.returncode, 1)
            self.assertNotIn("Traceback", alone.stderr)

    def test_tracks_of_a_data_set_follow_the_skin(self):
        lens = {"width": 64, "height": 48, "fx": 60, "fy": 60, "cx": 32, "cy": 24,
                "distortion_k1_k2_p1_p2_k3": [-0.2, 0, 0, 0, 0]}
        for scope in (None, lens):
            with tempfile.TemporaryDirectory() as folder:
                spec = {"schema": "organbake/dataset/1", "frames": 12, "clip_frames": 6,
                        "size": [64, 48], "tracks": 30, "views": {"motion_deg": 30},
                        "pokes": {"count": [1, 1], "depth_mm": [2, 4], "radius_mm": [2, 3]}}
                spec.update({"scope": scope} if scope else {})
                pathlib.Path(folder, "spec.json").write_text(json.dumps(spec))
                subprocess.run([PROGRAM, BUNDLE, "--dataset", folder + "/spec.json", "-o",
                                folder + "/set", "--quiet"], check=True, stdout=subprocess.DEVNULL)
                shard = next(pathlib.Path(folder, "set/train").iterdir())
                self.assertEqual(sorted(f.name for f in shard.glob("tracks*")),
                                 ["tracks_0000.npz", "tracks_0006.npz"])
                camera = json.loads((shard / "cameras.json").read_text())["cameras"][6]
                with np.load(shard / "tracks_0006.npz") as tracks:
                    self.check_tracks(camera, **tracks)

    def check_tracks(self, camera, points, occluded, xyz_mm):
        self.assertEqual((points.shape, points.dtype), ((30, 6, 2), np.float32))
        self.assertEqual((occluded.shape, occluded.dtype), ((30, 6), np.bool_))
        self.assertEqual(len(np.unique(points[:, 0], axis=0)), 30)
        np.testing.assert_allclose(points[:, 0] % 1, 0.5, atol=1e-4)  # pixels' centres
        self.assertFalse(occluded[:, 0].any())
        self.assertGreater(np.abs(points[:, -1] - points[:, 0]).max(), 1)
        ray = xyz_mm[..., :2] / xyz_mm[..., 2:]
        k1 = camera.get("distortion_k1_k2_p1_p2_k3", [0])[0]
        ray = ray * (1 + k1 * (ray**2).sum(-1, keepdims=True))
        away = np.abs(ray * [camera["fx"], camera["fy"]] + [camera["cx"], camera["cy"]] - points)
        # Flow counts from the pixel's centre, and a sample is bound within its pixel; a lens takes
        # the part that fills most of four pixels, and is off by half of one at an outline.
        self.assertLess(away[~occluded].max(), 0.6)
        self.assertLess(np.median(away[~occluded]), 0.05)

    def test_forces_for_solvers_without_contact(self):
        tip = [self.skin + 2 * self.out]
        forces = self.player.contact_forces(tip)
        self.assertLess(forces.sum(0) @ self.out, -0.01)
        on_nodes = self.player.contact_forces(tip, nodes=True)
        self.assertEqual(on_nodes.shape, self.player.mesh().nodes_mm.shape)
        np.testing.assert_allclose(on_nodes.sum(0), forces.sum(0), atol=1e-9)
        self.assertEqual(np.abs(self.player.contact_forces([self.skin + 90 * self.out])).max(), 0)

    def test_sets_in_a_row_take_no_memory(self):
        state = self.player.proxy_mm()
        def run(count):
            for _ in range(count):
                self.player.set_vertices(state)
        run(1000)
        before = resident_kb()
        run(int(os.environ.get("ORGANPLAY_SETS", 50000)))
        self.assertLess(resident_kb() - before, 256)

    def test_an_organ_shows_in_a_notebook(self):
        still = organplay.show(self.player, 0.2, 0.1, width=160, height=120)._repr_png_()
        self.assertTrue(still.startswith(b"\x89PNG"))
        raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-f", "image2pipe", "-i", "-", "-f",
                              "rawvideo", "-pix_fmt", "rgb24", "-"], input=still, check=True,
                             capture_output=True).stdout
        np.testing.assert_array_equal(np.frombuffer(raw, np.uint8).reshape(120, 160, 3),
                                      self.player.draw(self.view).rgb)
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, "organ.html")
            page.write_text('<p title="x">organ</p>')
            shown = organplay.show(page)._repr_html_()
            self.assertIn("srcdoc=", shown)
            self.assertNotIn('title="x"', shown)  # escaped

    def test_says_what_it_does(self):
        stub = STUB.read_text()
        for kind in (organplay.Player, organplay.View, organplay.Picture, organplay.Pictures,
                     organplay.Mesh, organplay.Step, organplay.Scope, organplay.State):
            for name, member in vars(kind).items():
                if name.startswith("_") and name != "__init__":
                    continue
                self.assertTrue(inspect.getdoc(member) or name in ("width", "height", "organ_count"),
                                f"{kind.__name__}.{name}")
                self.assertIn(f"def {name}(", stub)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
