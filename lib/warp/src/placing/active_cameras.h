// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/warp/camera_shares.h"
#include "organbake/warp/pixel_box.h"
#include "organbake/warp/view.h"
#include "picture/tile_grid.h"
#include "placing/chunk_frame.h"
#include "placing/dirty_cells.h"
#include "placing/placed_faces.h"
#include "samples/sample_store.h"

namespace organbake {

struct DrawReport;

// What one camera does in one frame.
struct ActiveCamera {
  const SampleSet* set = nullptr;
  float weight = 0;  // its share in the view
  std::vector<ChunkFrame> chunks;
  TileLists tiles;  // chunks drawn, by tile
};

// What of the organ a frame shows.
struct VisibilitySummary {
  PixelBox box;  // of all pixels that may show some
  // By face: whether any of it is drawn, and some of that seen from near (kNearSplat).
  std::vector<std::uint8_t> shown, near;
};

// The up to three cameras that the viewing manifold names for a view, their chunks placed, culled
// and listed by tile. Kept between frames for its memory.
class ActiveCameras {
 public:
  // Those of used_cameras(weights), which the store must have.
  void choose(const SampleStore& store, const ViewWeights& weights);
  // Where faces are continued, the last placing was for the same cameras and view: chunks of those
  // that did not move stay, and what the others leave or enter is marked.
  void place(const PlacedFaces& faces, const View& view, const TileGrid& grid, DirtyCells& cells);

  std::span<const ActiveCamera> all() const { return std::span(cameras_).first(count_); }
  // Mean size of a texel on the surface by the cameras' shares, so that it changes as they do:
  // without a step. 1 when there are no samples.
  float texel_mm() const;
  // What becomes of the chunks of all faces; samples and faces drawn and skipped are added to the
  // report.
  VisibilitySummary summarise(std::size_t faces, DrawReport& report) const;

 private:
  std::array<ActiveCamera, 3> cameras_;
  std::size_t count_ = 0;
};

}  // namespace organbake
