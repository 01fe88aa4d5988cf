# SPDX-License-Identifier: Apache-2.0
"""Episodes of organplay.gym as a LeRobot data set, layout v3.0, with nothing but NumPy and ffmpeg.

    from organplay.lerobot import record
    record(env, "episodes", episodes=100)       # an OrganVectorEnv; by its task's expert

The same of an organ from the command line: python3 -m organplay.lerobot BUNDLE FOLDER.
Tables are Parquet files of one row group, plain and uncompressed (parquet.apache.org/docs/
file-format; its footer is in Thrift's compact protocol): few and small beside the video.
"""
from __future__ import annotations

import argparse
import json
import os
import pathlib
import struct
import subprocess
import sys
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from .gym import OrganVectorEnv
from .tasks import TASKS

_BINARY, _LIST, _STRUCT, _I32, _I64 = 8, 9, 12, 5, 6  # Thrift's compact types
_TYPES = {"b": 0, "i4": 1, "i8": 2, "f4": 4, "f8": 5, "U": 6}  # NumPy's kind: Parquet's type
VIDEO = "observation.images.scope"


def _varint(number: int) -> bytes:
    out = bytearray()
    while number > 127:
        out.append(number & 127 | 128)
        number >>= 7
    return bytes(out + bytes([number]))


def _thrift(kind: int, value: Any) -> bytes:
    if kind in (_I32, _I64):
        return _varint((value << 1) ^ (value >> 63))
    if kind == _BINARY:
        return _varint(len(value.encode())) + value.encode()
    if kind == _LIST:
        of, items = value
        head = bytes([len(items) << 4 | of]) if len(items) < 15 else bytes([0xF0 | of]) + _varint(len(items))
        return head + b"".join(_thrift(of, item) for item in items)
    last, out = 0, b""
    for field, of, item in value:  # a struct
        out += bytes([(field - last) << 4 | of]) + _thrift(of, item)
        last = field
    return out + b"\0"


def _kind(values: np.ndarray) -> int:
    return _TYPES[values.dtype.kind if values.dtype.kind in "bU" else values.dtype.str[1:]]


def _plain(values: np.ndarray) -> bytes:
    if values.dtype.kind == "U":
        texts = [text.encode() for text in values.ravel()]
        return b"".join(struct.pack("<I", len(text)) + text for text in texts)
    if values.dtype.kind == "b":
        return np.packbits(values.ravel(), bitorder="little").tobytes()
    return np.ascontiguousarray(values).tobytes()


def _levels(bits: np.ndarray) -> bytes:
    packed = np.packbits(bits, bitorder="little").tobytes()
    run = _varint(len(packed) << 1 | 1) + packed  # one run, bit by bit
    return struct.pack("<I", len(run)) + run


def write_parquet(path: Union[str, os.PathLike], columns: Dict[str, np.ndarray],
                  told: Optional[Dict[str, str]] = None) -> None:
    """A table. columns: by name (rows,), or (rows, n) for lists of n ≥ 1, of bool, int32, int64,
    float32, float64 or text; none is missing. told: key and value texts of the file."""
    rows = len(next(iter(columns.values())))
    schema: List[Any] = [[(4, _BINARY, "schema"), (5, _I32, len(columns))]]
    body, chunks = b"PAR1", []
    for name, values in columns.items():
        kind, lists = _kind(values), values.ndim == 2
        text = [(6, _I32, 0)] if kind == 6 else []
        if lists:
            schema += [[(3, _I32, 0), (4, _BINARY, name), (5, _I32, 1), (6, _I32, 3)],
                       [(3, _I32, 2), (4, _BINARY, "list"), (5, _I32, 1)]]
        schema.append([(1, _I32, kind), (3, _I32, 0), (4, _BINARY, "element" if lists else name)] + text)
        data = _plain(values)
        if lists:
            follows = np.ones(values.shape, np.uint8)
            follows[:, 0] = 0
            data = _levels(follows.ravel()) + _levels(np.ones(values.size, np.uint8)) + data
        page = _thrift(_STRUCT, [(1, _I32, 0), (2, _I32, len(data)), (3, _I32, len(data)), (5, _STRUCT, [
            (1, _I32, values.size), (2, _I32, 0), (3, _I32, 3), (4, _I32, 3)])])
        size = len(page) + len(data)
        chunks.append([(2, _I64, len(body)), (3, _STRUCT, [
            (1, _I32, kind), (2, _LIST, (_I32, [0, 3])),
            (3, _LIST, (_BINARY, [name, "list", "element"] if lists else [name])), (4, _I32, 0),
            (5, _I64, values.size), (6, _I64, size), (7, _I64, size), (9, _I64, len(body))])])
        body += page + data
    group = [(1, _LIST, (_STRUCT, chunks)), (2, _I64, len(body)), (3, _I64, rows)]
    footer = _thrift(_STRUCT, [
        (1, _I32, 1), (2, _LIST, (_STRUCT, schema)), (3, _I64, rows), (4, _LIST, (_STRUCT, [group])),
        (5, _LIST, (_STRUCT, [[(1, _BINARY, key), (2, _BINARY, text)] for key, text in (told or {}).items()])),
        (6, _BINARY, "organplay")])
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(body + footer + struct.pack("<I", len(footer)) + b"PAR1")


def _statistics(values: np.ndarray) -> Dict[str, np.ndarray]:
    """Of (frames, n), or of pictures (frames, h, w, 3), whose numbers go from 0 to 1."""
    if values.ndim == 4:
        values = values.reshape(-1, 3) / 255.0
    values = values.reshape(len(values), -1).astype(np.float64)
    return {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}


class EpisodeWriter:
    """Writes episodes, one after the other, into a new folder; close(), or the end of its `with`,
    makes it a data set. What an error ends is left without info.json.

    Raises ValueError for a folder that holds something, OSError where it cannot be written or
    ffmpeg, which makes the video, is missing.
    """

    def __init__(self, folder: Union[str, os.PathLike], task: str, fps: int,
                 size: Optional[Tuple[int, int]] = None) -> None:
        self.folder, self.task, self.fps, self.size = pathlib.Path(folder), task, fps, size
        if self.folder.exists() and any(self.folder.iterdir()):
            raise ValueError(f"{folder}: holds something else; name a new folder")
        self._rows: Dict[str, List[np.ndarray]] = {}
        self._episodes: List[Dict[str, Any]] = []
        self._picture_sums: List[Dict[str, np.ndarray]] = []
        self._video: Optional[subprocess.Popen] = None
        if size:
            file = self.folder / "videos" / VIDEO / "chunk-000" / "file-000.mp4"
            file.parent.mkdir(parents=True)
            self._video = subprocess.Popen(
                ["ffmpeg", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s",
                 f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-", "-c:v", "libx264", "-g", "2",
                 "-pix_fmt", "yuv420p", str(file)], stdin=subprocess.PIPE)

    def add(self, state: np.ndarray, action: np.ndarray, reward: np.ndarray, solved: bool,
            rgb: Optional[np.ndarray] = None) -> None:
        """An episode. state: (n, s) float32; action: (n, a) float32; reward: (n,); rgb:
        (n, h, w, 3) uint8, with a size."""
        count, number = len(state), len(self._episodes)
        if not (len(action) == len(reward) == count > 0):
            raise ValueError(f"{count} states for {len(action)} actions and {len(reward)} rewards")
        if self.size and np.shape(rgb) != (count, self.size[1], self.size[0], 3):
            raise ValueError(f"an episode of {count} steps takes pictures of shape "
                             f"{(count, self.size[1], self.size[0], 3)}; these have {np.shape(rgb)}")
        begin = sum(e["length"] for e in self._episodes)
        done = np.arange(count) == count - 1
        columns = {"observation.state": np.asarray(state, np.float32), "action": np.asarray(action, np.float32),
                   "next.reward": np.asarray(reward, np.float32), "next.done": done,
                   "next.success": done & solved,
                   "timestamp": (np.arange(count) / self.fps).astype(np.float32),
                   "frame_index": np.arange(count), "episode_index": np.full(count, number),
                   "index": begin + np.arange(count), "task_index": np.zeros(count, np.int64)}
        for key, values in columns.items():
            self._rows.setdefault(key, []).append(values)
        episode = {"episode_index": number, "tasks": [self.task], "length": count,
                   "dataset_from_index": begin, "dataset_to_index": begin + count,
                   "data/chunk_index": 0, "data/file_index": 0,
                   "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        told = {key: _statistics(values) for key, values in columns.items()}
        if self._video and self._video.stdin:
            self._video.stdin.write(np.ascontiguousarray(rgb).tobytes())
            told[VIDEO] = _statistics(rgb)
            self._picture_sums.append({**told[VIDEO], "count": np.array([count])})
            episode.update({f"videos/{VIDEO}/chunk_index": 0, f"videos/{VIDEO}/file_index": 0,
                            f"videos/{VIDEO}/from_timestamp": begin / self.fps,
                            f"videos/{VIDEO}/to_timestamp": (begin + count) / self.fps})
        for key, numbers in told.items():
            for name, value in numbers.items():
                episode[f"stats/{key}/{name}"] = list(value)
            episode[f"stats/{key}/count"] = [count]
        self._episodes.append(episode)

    def __enter__(self) -> "EpisodeWriter":
        return self

    def __exit__(self, error: Any, *more: Any) -> None:
        if error is None:
            self.close()
        elif self._video and self._video.stdin:
            self._video.stdin.close()
            self._video.wait()

    def _features(self) -> Dict[str, Any]:
        features = {key: {"dtype": str(parts[0].dtype), "names": None,
                          "shape": list(parts[0].shape[1:]) or [1]} for key, parts in self._rows.items()}
        if self.size:
            features[VIDEO] = {"dtype": "video", "shape": [self.size[1], self.size[0], 3],
                               "names": ["height", "width", "channels"],
                               "info": {"video.fps": self.fps, "video.codec": "h264",
                                        "video.pix_fmt": "yuv420p", "video.is_depth_map": False,
                                        "has_audio": False}}
        return features

    def _all_statistics(self) -> Dict[str, Any]:
        told = {key: {n: v.tolist() for n, v in _statistics(np.concatenate(parts)).items()}
                for key, parts in self._rows.items()}
        frames = sum(e["length"] for e in self._episodes)
        if self._picture_sums:
            weights = np.array([s["count"][0] for s in self._picture_sums]) / frames
            means, stds = (np.array([s[k] for s in self._picture_sums]) for k in ("mean", "std"))
            mean = weights @ means
            std = np.sqrt(weights @ (stds**2 + (means - mean) ** 2))
            low, high = (np.array([s[k] for s in self._picture_sums]) for k in ("min", "max"))
            told[VIDEO] = {key: value.reshape(3, 1, 1).tolist() for key, value in
                           (("min", low.min(0)), ("max", high.max(0)), ("mean", mean), ("std", std))}
        return {key: {**numbers, "count": [frames]} for key, numbers in told.items()}

    def close(self) -> None:
        """Writes tables, statistics and info.json, which makes the folder a data set."""
        if self._video and self._video.stdin:
            self._video.stdin.close()
            if self._video.wait() != 0:
                raise OSError(f"{self.folder}: ffmpeg could not write the video")
        if not self._episodes:
            raise ValueError("there are no episodes to write")
        rows = {key: np.concatenate(parts) for key, parts in self._rows.items()}
        write_parquet(self.folder / "data/chunk-000/file-000.parquet", rows)
        write_parquet(self.folder / "meta/episodes/chunk-000/file-000.parquet", {
            key: np.array([e[key] for e in self._episodes]) for key in self._episodes[0]})
        index = {"index_columns": ["task"], "column_indexes": [], "pandas_version": "1.5.3", "columns": [
            {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": of, "metadata": None}
            for name, kind, of in (("task_index", "int64", "int64"), ("task", "unicode", "object"))]}
        write_parquet(self.folder / "meta/tasks.parquet",
                      {"task_index": np.zeros(1, np.int64), "task": np.array([self.task])},
                      {"pandas": json.dumps(index)})
        path = "{}chunk-{{chunk_index:03d}}/file-{{file_index:03d}}.{}"
        count = len(self._episodes)
        info = {"codebase_version": "v3.0", "robot_type": "organplay", "total_episodes": count,
                "total_frames": len(rows["index"]), "total_tasks": 1, "chunks_size": 1000,
                "data_files_size_in_mb": 100, "video_files_size_in_mb": 500, "fps": self.fps,
                "splits": {"train": f"0:{count}"}, "data_path": path.format("data/", "parquet"),
                "video_path": path.format("videos/{video_key}/", "mp4") if self.size else None,
                "features": self._features()}
        (self.folder / "meta/stats.json").write_text(json.dumps(self._all_statistics(), indent=1))
        (self.folder / "meta/info.json").write_text(json.dumps(info, indent=1))


def record(env: OrganVectorEnv, folder: Union[str, os.PathLike], episodes: int = 100, *,
           seed: int = 0, act: Optional[Callable[[Dict[str, np.ndarray]], np.ndarray]] = None,
           task: Optional[str] = None) -> int:
    """Plays episodes in all worlds at once and writes them in the order of their seeds.

    Episode k has the seed seed + k. act: observations to actions; None: the task's expert. task:
    its sentence; None: of the task's docstring. Returns how many were solved.
    """
    text = task or (type(env.task).__doc__ or env.task.name).strip().split("\n")[0]
    solved = 0
    with EpisodeWriter(folder, text, env.metadata["render_fps"], env.size) as writer:
        for first in range(0, episodes, env.num_envs):
            seen, _ = env.reset(seed=seed + first)
            kept: List[List[Tuple[Any, ...]]] = [[] for _ in range(env.num_envs)]
            ended = np.zeros(env.num_envs, bool)
            good = ended.copy()
            while not ended.all():
                action = env.expert_actions() if act is None else act(seen)
                following, reward, done, cut, told = env.step(action)
                for i in np.flatnonzero(~ended):
                    kept[i].append((seen["state"][i], action[i], reward[i]) +
                                   ((seen["rgb"][i],) if env.size else ()))
                good |= ~ended & told["solved"]
                ended |= done | cut
                seen = following
            for i in range(min(env.num_envs, episodes - first)):
                writer.add(*(np.stack(part) for part in list(zip(*kept[i]))[:3]), bool(good[i]),
                           np.stack([row[3] for row in kept[i]]) if env.size else None)
                solved += int(good[i])
    return solved


__all__: Sequence[str] = ["EpisodeWriter", "record", "write_parquet"]


def main() -> None:
    """An expert's episodes of an organ: python3 -m organplay.lerobot --help."""
    parser = argparse.ArgumentParser(prog="python3 -m organplay.lerobot", description=main.__doc__)
    parser.add_argument("bundle")
    parser.add_argument("folder")
    parser.add_argument("--task", default="press", choices=list(TASKS))
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, nargs=2, default=(128, 128), metavar=("WIDTH", "HEIGHT"))
    given = parser.parse_args()
    if given.episodes < 1:
        parser.error("--episodes must be 1 or more")
    try:
        with OrganVectorEnv(given.bundle, given.task, min(4, given.episodes),
                            size=tuple(given.size)) as env:
            solved = record(env, given.folder, given.episodes, seed=given.seed)
    except (ValueError, OSError) as error:
        sys.exit(f"organplay.lerobot: error: {error}")
    print(f"{solved} of {given.episodes} episodes solved")


if __name__ == "__main__":
    main()
