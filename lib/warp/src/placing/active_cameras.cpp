// SPDX-License-Identifier: Apache-2.0
#include "placing/active_cameras.h"

#include <algorithm>

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
  for (ActiveCamera& camera : std::span(cameras_).first(count_)) {
    const std::vector<Chunk>& chunks = camera.set->chunks;
    camera.chunks.resize(chunks.size());
    const auto face_of = [&](std::size_t c) { return chunks[c].patch.face; };
    const auto place_batch = [&](std::size_t first, std::size_t last) {
      const std::uint32_t face = face_of(first);
      if (!faces.moved(face)) return;
      const std::span placed = std::span(camera.chunks).subspan(first, last - first);
      const auto mark = [&] {
        if (!faces.continued()) return;
        for (const ChunkFrame& chunk : placed) cells.mark(chunk.box);
      };
      mark();
      place_patches(camera.set->patches, first, static_cast<int>(last - first), faces[face], view,
                    placed.data());
      mark();
    };
    constexpr std::size_t kGrain = 256;
    parallel_pieces(std::size_t{0}, chunks.size(), kGrain, [&](std::size_t c, std::size_t last) {
      while (c < last) {
        const std::size_t end = end_of_batch(c, last, face_of);
        place_batch(c, end);
        c = end;
      }
    });
    camera.tiles.build(grid, static_cast<std::uint32_t>(chunks.size()),
                       [&](std::uint32_t c) { return camera.chunks[c].box; });
  }
}

// In one pass: there are tens of thousands of chunks.
VisibilitySummary ActiveCameras::summarise(std::size_t faces, DrawReport& report) const {
  // In registers: a box in memory is a chain of loads that wait for stores.
  PixelBox box;
  VisibilitySummary visibility;
  visibility.shown.assign(faces, 0);
  visibility.stretched.assign(faces, 0);
  int largest_px = 0;
  for (const ActiveCamera& camera : all()) {
    const std::vector<Chunk>& chunks = camera.set->chunks;
    for (std::size_t c = 0; c < chunks.size();) {
      const std::uint32_t face = chunks[c].patch.face;
      std::array<std::size_t, 3> samples{};
      int face_px = 0;
      for (; c < chunks.size() && chunks[c].patch.face == face; ++c) {
        const ChunkFrame& chunk = camera.chunks[c];
        samples[static_cast<int>(chunk.fate)] += chunks[c].count;
        if (chunk.fate != ChunkFate::drawn) continue;
        face_px = std::max({face_px, chunk.columns, chunk.rows});
        box = united(box, chunk.box);
      }
      report.samples_drawn += samples[0];
      report.samples_facing_away += samples[1];
      report.samples_outside_view += samples[2];
      largest_px = std::max(largest_px, face_px);
      visibility.shown[face] |= samples[0] > 0;
      visibility.stretched[face] |= face_px >= kMostSplat;
      if (samples[0] > 0) {
        ++report.faces_drawn;
      } else {
        ++(samples[2] > 0 ? report.faces_outside_view : report.faces_facing_away);
      }
    }
  }
  visibility.box = box;
  report.largest_stretch_px = std::max<double>(report.largest_stretch_px, largest_px);
  return visibility;
}

}  // namespace organbake
