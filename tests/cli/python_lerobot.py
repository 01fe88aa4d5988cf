# SPDX-License-Identifier: GPL-3.0-or-later
# usage: python_lerobot.py BUNDLE: what organplay.lerobot writes, by a Parquet reader of its own that
# knows the format's description alone, against what the environment gave.
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from organplay import gym, lerobot
from organplay.tasks import Press

BUNDLE = sys.argv[1]
KINDS = {0: "?", 1: "<i4", 2: "<i8", 4: "<f4", 5: "<f8"}


class Thrift:
    """Reads the compact protocol into dicts of field numbers."""

    def __init__(self, data, at=0):
        self.data, self.at = data, at

    def varint(self):
        number = shift = 0
        while True:
            byte = self.data[self.at]
            self.at += 1
            number |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return number

    def value(self, kind):
        if kind in (5, 6):
            number = self.varint()
            return (number >> 1) ^ -(number & 1)
        if kind == 8:
            count = self.varint()
            self.at += count
            return self.data[self.at - count:self.at].decode()
        if kind == 9:
            head = self.data[self.at]
            self.at += 1
            count = head >> 4 if head >> 4 < 15 else self.varint()
            return [self.value(head & 15) for _ in range(count)]
        assert kind == 12, kind
        fields, last = {}, 0
        while self.data[self.at] != 0:
            head = self.data[self.at]
            self.at += 1
            assert head >> 4, "long field numbers are not expected"
            last += head >> 4
            fields[last] = self.value(head & 15)
        self.at += 1
        return fields


def read_parquet(path):
    """{column: array} and {key: text}; lists of one length as (rows, n)."""
    data = pathlib.Path(path).read_bytes()
    assert data[:4] == data[-4:] == b"PAR1"
    length = struct.unpack("<I", data[-8:-4])[0]
    footer = Thrift(data, len(data) - 8 - length).value(12)
    (group,), columns = footer[4], {}
    for chunk in group[1]:
        about = chunk[3]
        reader = Thrift(data, about[9])
        page = reader.value(12)
        count, at, end = page[5][1], reader.at, reader.at + page[3]
        assert end - about[9] == about[7] and page[2] == page[3] and about[4] == 0
        rows = count
        if len(about[3]) == 3:  # a list: what repeats, then what is there
            levels = []
            for _ in range(2):
                size = struct.unpack_from("<I", data, at)[0]
                run = Thrift(data, at + 4)
                header = run.varint()
                assert header & 1
                packed = np.frombuffer(data, np.uint8, header >> 1, run.at)
                levels.append(np.unpackbits(packed, bitorder="little")[:count])
                at += 4 + size
            rows = int((levels[0] == 0).sum())
            assert levels[1].all()
        if about[1] == 6:
            values = []
            for _ in range(count):
                size = struct.unpack_from("<I", data, at)[0]
                values.append(data[at + 4:at + 4 + size].decode())
                at += 4 + size
            values = np.array(values)
        elif about[1] == 0:
            values = np.unpackbits(np.frombuffer(data, np.uint8, end - at, at), bitorder="little")
            values = values[:count].astype(bool)
        else:
            values = np.frombuffer(data, KINDS[about[1]], count, at)
        assert rows == group[3] == footer[3]
        columns[about[3][0]] = values.reshape(rows, -1) if len(about[3]) == 3 else values
    return columns, {pair[1]: pair[2] for pair in footer.get(5, [])}


class LeRobotTest(unittest.TestCase):
    def test_tables_are_read_back(self):
        random = np.random.default_rng(1)
        columns = {"whole": np.arange(20) - 9, "short": np.arange(20, dtype=np.int32),
                   "real": random.normal(size=20).astype(np.float32), "fine": random.normal(size=20),
                   "text": np.array(["größe %d" % i for i in range(20)]),
                   "flag": random.random(20) < 0.5, "list": random.normal(size=(20, 7)),
                   "texts": np.array([["a", "bc"]] * 20)}
        columns.update({f"more {i}": np.arange(20) for i in range(20)})  # long lists have long heads
        with tempfile.TemporaryDirectory() as folder:
            lerobot.write_parquet(folder + "/t.parquet", columns, {"key": "word"})
            back, told = read_parquet(folder + "/t.parquet")
        self.assertEqual(told, {"key": "word"})
        self.assertEqual(list(back), list(columns))
        for name, values in columns.items():
            np.testing.assert_array_equal(back[name], values, name)

    def test_episodes_are_what_the_environment_gave(self):
        task = Press(radius_mm=3, force_n=(0.05, 0.2))
        with tempfile.TemporaryDirectory() as folder, gym.OrganVectorEnv(
                BUNDLE, task, 2, size=(32, 24)) as env:
            data = pathlib.Path(folder, "d")
            solved = lerobot.record(env, data, 3, seed=4)
            rows, _ = read_parquet(data / "data/chunk-000/file-000.parquet")
            episodes, _ = read_parquet(data / "meta/episodes/chunk-000/file-000.parquet")
            tasks, told = read_parquet(data / "meta/tasks.parquet")
            info = json.loads((data / "meta/info.json").read_text())
            stats = json.loads((data / "meta/stats.json").read_text())
            # Episode 1, seed 5, once more.
            env.reset(seed=[5, 99])
            first, last = episodes["dataset_from_index"][1], episodes["dataset_to_index"][1]
            for row in range(first, last):
                seen, _ = (env.reset(seed=[5, 99]) if row == first else (seen, None))
                action = env.expert_actions()
                np.testing.assert_array_equal(rows["observation.state"][row], seen["state"][0])
                np.testing.assert_array_equal(rows["action"][row], action[0])
                seen, reward, *_ = env.step(action)
                self.assertEqual(rows["next.reward"][row], np.float32(reward[0]))
            frames = info["total_frames"]
            self.assertEqual(info["codebase_version"], "v3.0")
            self.assertEqual((info["total_episodes"], len(rows["index"])), (3, frames))
            np.testing.assert_array_equal(rows["index"], np.arange(frames))
            np.testing.assert_array_equal(episodes["length"], np.bincount(rows["episode_index"]))
            self.assertEqual(rows["next.done"].sum(), 3)
            self.assertEqual(rows["next.success"].sum(), solved)
            self.assertTrue((rows["timestamp"] == (rows["frame_index"] / 60).astype(np.float32)).all())
            for key in ("observation.state", "action"):
                np.testing.assert_allclose(stats[key]["mean"], rows[key].mean(0, dtype=float))
                np.testing.assert_allclose(stats[key]["std"], rows[key].std(0, dtype=float), atol=1e-12)
                np.testing.assert_array_equal(stats[key]["max"], rows[key].max(0))
                self.assertEqual(stats[key]["count"], [frames])
                self.assertEqual(info["features"][key]["shape"], [rows[key].shape[1]])
            self.assertEqual(json.loads(told["pandas"])["index_columns"], ["task"])
            self.assertEqual(list(tasks["task"]), list(episodes["tasks"][0]))
            video = data / info["video_path"].format(video_key=lerobot.VIDEO, chunk_index=0, file_index=0)
            raw = subprocess.run(["ffmpeg", "-loglevel", "error", "-i", video, "-f", "rawvideo", "-pix_fmt",
                                  "rgb24", "-"], check=True, capture_output=True).stdout
            pictures = np.frombuffer(raw, np.uint8).reshape(-1, 24, 32, 3) / 255.0
            self.assertEqual(len(pictures), frames)
            mean = np.ravel(stats[lerobot.VIDEO]["mean"])
            # The video is lossy: of all its pixels' mean less than two of 255 levels.
            np.testing.assert_allclose(pictures.mean((0, 1, 2)), mean, atol=2 / 255)
            with self.assertRaisesRegex(ValueError, "holds something else"):
                lerobot.record(env, data, 1)

    def test_what_cannot_be_written_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            writer = lerobot.EpisodeWriter(folder + "/d", "press", 60)
            with self.assertRaisesRegex(ValueError, "no episodes"):
                writer.close()
            with self.assertRaisesRegex(ValueError, "2 states for 3 actions"):
                writer.add(np.zeros((2, 4)), np.zeros((3, 3)), np.zeros(2), False)
            with self.assertRaisesRegex(ValueError, "pictures"):
                with lerobot.EpisodeWriter(folder + "/e", "press", 60, (8, 8)) as writer:
                    writer.add(np.zeros((2, 4)), np.zeros((2, 3)), np.zeros(2), False)
            self.assertFalse(pathlib.Path(folder, "e/meta/info.json").exists())

    def test_the_command_line_records_or_says_why_not(self):
        def run(*arguments):
            return subprocess.run([sys.executable, "-m", "organplay.lerobot", *arguments], text=True,
                                  capture_output=True)

        with tempfile.TemporaryDirectory() as folder:
            said = run(BUNDLE, folder + "/d", "--episodes", "1", "--size", "32", "24")
            self.assertEqual((said.returncode, said.stderr), (0, ""))
            self.assertRegex(said.stdout, "^[01] of 1 episodes solved")
            again = run(BUNDLE, folder + "/d", "--episodes", "1")
            self.assertEqual(again.returncode, 1)
            self.assertIn("holds something else", again.stderr)
            missing = run("nowhere", folder + "/e")
            self.assertRegex(missing.stderr, "^organplay.lerobot: error: nowhere")
            self.assertFalse(pathlib.Path(folder, "e").exists())
        self.assertEqual(run("--help").returncode, 0)
        self.assertEqual(run(BUNDLE, "x", "--episodes", "0").returncode, 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
