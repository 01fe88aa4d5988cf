// SPDX-License-Identifier: Apache-2.0
#include "placing/active_cameras.h"

#include <algorithm>
#include <mutex>

#include "organbake/core/parallel.h"
#include "organbake/warp/draw_options.h"
#include "placing/patch_frames.h"

namespace organbake {

void ActiveCameras::choose(const SampleStore& store, const ViewWeights& weights) {
  count_ = 0;
  for (int i = 0; i < 3; ++i) {
    if (weights.weights[i] <= 0) continue;
    cameras_[count_].set = &store[weights.cameras[i]];
    cameras_[count_++].weight = static_cast<float>(weights.weights[i]);
  }
}

float ActiveCameras::texel_mm() const {
  double sum = 0, shares = 0;
  for (const ActiveCamera& camera : all()) {
    if (camera.set->sample_count == 0) continue;
    sum += camera.weight * camera.set->texel_mm;
    shares += camera.weight;
  }
  return shares > 0 ? static_cast<float>(sum / shares) : 1;
}

void ActiveCameras::place(const PlacedFaces& faces, const View& view, const TileGrid& grid,
                          DirtyCells& cells) {
  parallel_for(std::size_t{0}, count_, [&](std::size_t number) {
    ActiveCamera& camera = cameras_[number];
    const PatchTable& patches = camera.set->patches;
    camera.chunks.resize(camera.set->chunks.size());
    const auto mark_moved = [&](std::size_t c, std::size_t last) {
      if (!faces.continued()) return;
      for (; c < last; ++c)
        if (faces.moved(patches.face(c))) cells.mark(camera.chunks[c].box);
    };
    const auto place_batch = [&](std::size_t first, std::size_t last) {
      if (!faces.any_moved(patches, first, last)) return;
      mark_moved(first, last);
      place_patches(patches, first, static_cast<int>(last - first), faces.all(), view,
                    &camera.chunks[first]);
      mark_moved(first, last);
    };
    constexpr std::size_t kGrain = 4 * kPatchBatch;
    parallel_pieces(std::size_t{0}, camera.chunks.size(), kGrain,
                    [&](std::size_t c, std::size_t last) {
                      for (; c < last; c += kPatchBatch)
                        place_batch(c, std::min(last, c + kPatchBatch));
                    });
    camera.tiles.build(grid, static_cast<std::uint32_t>(camera.chunks.size()),
                       [&](std::uint32_t c) { return camera.chunks[c].box; });
  });
}

namespace {

// What is counted of some of a camera's faces, and of all of them together.
struct ChunkCounts {
  PixelBox box;
  std::array<std::size_t, 3> samples{}, faces{};  // by ChunkVisibility
  int largest_px = 0;

  void add(const ChunkCounts& more) {
    box = united(box, more.box);
    for (std::size_t fate = 0; fate < samples.size(); ++fate) {
      samples[fate] += more.samples[fate];
      faces[fate] += more.faces[fate];
    }
    largest_px = std::max(largest_px, more.largest_px);
  }
};

// From any thread: faces of several cameras may be the same.
void flag(std::uint8_t& flag) { __atomic_store_n(&flag, std::uint8_t{1}, __ATOMIC_RELAXED); }

// Of the faces whose first chunk is one of first … last − 1. In one pass: there are tens of
// thousands of chunks.
ChunkCounts count_chunks(const ActiveCamera& camera, std::size_t first, std::size_t last,
                         VisibilitySummary& visibility) {
  const std::vector<Chunk>& chunks = camera.set->chunks;
  const auto face_of = [&](std::size_t c) { return chunks[c].patch.face; };
  while (first > 0 && first < last && face_of(first) == face_of(first - 1)) ++first;
  // In registers: a box in memory is a chain of loads that wait for stores.
  PixelBox box;
  ChunkCounts counts;
  for (std::size_t c = first; c < last;) {
    const std::uint32_t face = face_of(c);
    std::array<std::size_t, 3> samples{};
    int face_px = 0;
    for (; c < chunks.size() && face_of(c) == face; ++c) {
      const ChunkFrame& chunk = camera.chunks[c];
      samples[static_cast<int>(chunk.visibility)] += chunks[c].count;
      if (chunk.visibility != ChunkVisibility::drawn) continue;
      face_px = std::max({face_px, chunk.columns, chunk.rows});
      box = united(box, chunk.box);
    }
    for (std::size_t fate = 0; fate < samples.size(); ++fate) counts.samples[fate] += samples[fate];
    counts.largest_px = std::max(counts.largest_px, face_px);
    if (samples[0] > 0) flag(visibility.shown[face]);
    if (face_px >= kNearSplat) flag(visibility.near[face]);
    const ChunkVisibility fate = samples[0] > 0   ? ChunkVisibility::drawn
                                 : samples[2] > 0 ? ChunkVisibility::outside_view
                                                  : ChunkVisibility::faces_away;
    ++counts.faces[static_cast<int>(fate)];
  }
  counts.box = box;
  return counts;
}

}  // namespace

VisibilitySummary ActiveCameras::summarise(std::size_t faces, DrawReport& report) const {
  VisibilitySummary visibility;
  visibility.shown.assign(faces, 0);
  visibility.near.assign(faces, 0);
  constexpr std::size_t kGrain = 2048;
  ChunkCounts counts;
  std::mutex mutex;
  parallel_for(std::size_t{0}, count_, [&](std::size_t number) {
    const ActiveCamera& camera = cameras_[number];
    parallel_pieces(std::size_t{0}, camera.chunks.size(), kGrain,
                    [&](std::size_t first, std::size_t last) {
                      const ChunkCounts more = count_chunks(camera, first, last, visibility);
                      const std::lock_guard lock(mutex);
                      counts.add(more);  // whole numbers: in any order
                    });
  });
  report.samples_drawn += counts.samples[0];
  report.samples_facing_away += counts.samples[1];
  report.samples_outside_view += counts.samples[2];
  report.faces_drawn += counts.faces[0];
  report.faces_facing_away += counts.faces[1];
  report.faces_outside_view += counts.faces[2];
  report.largest_stretch_px = std::max<double>(report.largest_stretch_px, counts.largest_px);
  visibility.box = counts.box;
  return visibility;
}

}  // namespace organbake
