# SPDX-License-Identifier: GPL-3.0-or-later
# usage: python_module.py BUNDLE ORGANPLAY: tests of organplay's player, against the program; of its
# pictures: python_pictures.py.
import gc
import inspect
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


class PlayerCase(unittest.TestCase):
    def setUp(self):
        self.player = organplay.Player(BUNDLE)
        self.view = self.player.orbit(*np.radians([12, 6]), width=160, height=120)
        # From aside, or the tool would hide all that it touches.
        self.out = self.view.camera_from_world[0, :3] - self.view.camera_from_world[2, :3]
        self.out /= np.linalg.norm(self.out)
        self.skin = np.array(self.player.skin_point(self.out))

    def poke(self, depth_mm, steps=10):
        for i in range(steps):
            step = self.player.step([self.skin + (5 - depth_mm * (i + 1) / steps) * self.out])
        return step


class PlayerTest(PlayerCase):
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

    def test_tissue_is_as_stiff_as_it_is_asked_to_be(self):
        soft = self.poke(3).forces_n[0]
        self.player.reset(stiffness=2)
        stiff = self.poke(3).forces_n[0]
        self.assertGreater(stiff @ self.out, 1.5 * soft @ self.out)
        saved = self.player.save_state()
        self.player.reset(1)
        np.testing.assert_array_equal(self.poke(3).forces_n[0], soft)
        self.player.restore_state(saved)  # as stiff as it was then
        self.player.reset()
        np.testing.assert_array_equal(self.poke(3).forces_n[0], stiff)
        with self.assertRaisesRegex(ValueError, "stiffness is 0; it must be 0.05 to 20"):
            self.player.reset(0)
        self.player.reset()
        np.testing.assert_array_equal(self.poke(3).forces_n[0], stiff)  # nothing was changed

    def test_threads_and_version(self):
        one = organplay.Player(BUNDLE, threads=1)
        np.testing.assert_array_equal(one.draw(self.view).rgb, self.player.draw(self.view).rgb)
        with self.assertRaisesRegex(ValueError, "threads is 0"):
            organplay.Player(BUNDLE, threads=0)
        said = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout
        self.assertIn(organplay.__version__, said)

    def test_examples_say_how_they_are_called(self):
        for example in ("poke_video", "play_trajectory", "numpy_solver", "train_press"):
            command = ["/usr/bin/python3", str(EXAMPLES / (example + ".py"))]
            helped = subprocess.run(command + ["--help"], capture_output=True, text=True)
            self.assertEqual((helped.returncode, helped.stderr), (0, ""))
            self.assertIn(example + ".py BUNDLE", helped.stdout)
            alone = subprocess.run(command, capture_output=True, text=True)
            self.assertEqual(alone.returncode, 1)
            self.assertNotIn("Traceback", alone.stderr)

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

    def test_says_what_it_does(self):
        stub = STUB.read_text()
        for kind in (organplay.Player, organplay.View, organplay.Picture, organplay.Pictures,
                     organplay.Mesh, organplay.Step, organplay.Scope, organplay.State):
            for name, member in vars(kind).items():
                if name.startswith("_") and name != "__init__":
                    continue
                self.assertTrue(inspect.getdoc(member) or name in ("width", "height", "organ_count"),
                                f"{kind.__name__}.{name}")
                self.assertRegex(stub, rf"\b{name}(\(|: Final)")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
