# SPDX-License-Identifier: GPL-3.0-or-later
# usage: python_pictures.py BUNDLE ORGANPLAY: tests of organplay's pictures, their layers, and states
# of other solvers that are drawn, one by one or many at once.
import gc
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import organplay
from python_module import BUNDLE, PROGRAM, PlayerCase


class OfAnotherLibrary:
    """What is no array, but tells of its memory by DLPack."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, stream=None):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def pixels_of(png):
    """Of a picture of 160 x 120, a file or its bytes."""
    given = {"input": png} if isinstance(png, bytes) else {}
    source = ["-f", "image2pipe", "-i", "-"] if given else ["-i", str(png)]
    raw = subprocess.run(["ffmpeg", "-loglevel", "error", *source, "-f", "rawvideo", "-pix_fmt",
                          "rgb24", "-"], check=True, capture_output=True, **given).stdout
    return np.frombuffer(raw, np.uint8).reshape(120, 160, 3)


class PicturesTest(PlayerCase):
    def test_draws_what_the_program_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "p.png")
            subprocess.run([PROGRAM, BUNDLE, "-o", file, "--view-deg", "12,6", "--size", "160x120",
                            "--quiet"], check=True, stdout=subprocess.DEVNULL)
            np.testing.assert_array_equal(self.player.draw(self.view).rgb, pixels_of(file))

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
        # Depth alone is bound to the faces that are drawn; rounding may turn a pixel at an outline.
        alone = self.player.draw_many(states, views, "depth,mask")
        self.assertLess((alone.depth_mm != many.depth_mm).mean(), 1e-4)
        np.testing.assert_array_equal(alone.rgb, many.rgb)
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

    def test_draws_as_a_scope_and_two_eyes_see(self):
        with tempfile.TemporaryDirectory() as folder:
            lens = pathlib.Path(folder, "lens.json")
            lens.write_text('{"width": 160, "height": 120, "fx": 150, "fy": 150, "cx": 80, "cy": 60,'
                            '"distortion_k1_k2_p1_p2_k3": [-0.2, 0, 0, 0, 0],'
                            '"vignette_exponent": 3, "picture": {"exposure": 1.5, "grain": 4}}')
            file = os.path.join(folder, "p.png")
            subprocess.run([PROGRAM, BUNDLE, "-o", file, "--view-deg", "12,6", "--size", "160x120",
                            "--scope", str(lens), "--stereo-mm", "5", "--layers", "depth",
                            "--quiet"], check=True, stdout=subprocess.DEVNULL)
            scope = organplay.Scope(lens)
            self.assertEqual(scope.size, (160, 120))
            picture = self.player.draw(self.view, ["depth"], scope=scope, stereo_mm=5)
            for eye, name in ((picture.rgb, "p.png"), (picture.right_rgb, "p_right.png")):
                np.testing.assert_array_equal(pixels_of(os.path.join(folder, name)), eye)
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

    def test_layers_are_names(self):
        both = self.player.draw(self.view, ["depth", "mask"])
        self.assertIsNotNone(both.depth_mm)
        self.assertIsNotNone(both.mask)
        with self.assertRaisesRegex(TypeError, 'layers is 7; it must be names, as "depth,mask"'):
            self.player.draw(self.view, 7)
        with self.assertRaisesRegex(ValueError, "layers holds 7"):
            self.player.draw(self.view, ["depth", 7])

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

    def test_an_organ_shows_in_a_notebook(self):
        still = organplay.show(self.player, *np.radians([12, 6]), width=160, height=120)._repr_png_()
        self.assertTrue(still.startswith(b"\x89PNG"))
        np.testing.assert_array_equal(pixels_of(still), self.player.draw(self.view).rgb)
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder, "organ.html")
            page.write_text('<p title="x">organ</p>')
            shown = organplay.show(page)._repr_html_()
            self.assertIn("srcdoc=", shown)
            self.assertNotIn('title="x"', shown)  # escaped


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
