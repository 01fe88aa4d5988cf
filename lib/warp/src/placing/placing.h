// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/vertex_gradients.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"
#include "picture/spans.h"
#include "samples/samples.h"

namespace organbake {

// A bundle's shell as the proxy carries it now, and what drawing it asks of every face. Kept from
// one pose to the next: a poke moves few faces, and only they are worked out anew.
class PosedShell {
 public:
  explicit PosedShell(ShellSurface shell);

  // Takes the proxy's vertices (mm), of which there must be as many as at rest, and the folds that
  // graspers make of a smooth skin. Whether anything is otherwise than before.
  bool pose(const std::vector<Eigen::Vector3d>& proxy_positions,
            const std::vector<SkinFold>& folds);
  std::uint64_t poses() const { return poses_; }  // how many it has had

  const ShellSurface& shell() const { return shell_; }
  const TriangleMesh& at_rest() const { return shell_.at_rest(); }
  const std::vector<Eigen::Vector3d>& proxy_positions() const { return proxy_positions_; }
  const std::vector<SkinFold>& folds() const { return folds_; }
  const std::vector<ShellMatrix>& matrices() const { return matrices_; }  // by face, world
  // By face, another number whenever it may lie otherwise than before.
  const std::vector<std::uint32_t>& revisions() const { return revisions_; }
  // Whether a face is pushed, and bent out of its neighbours' skin: a deep poke folds slivers of a
  // coarse proxy over. Both its sides are skin then, or the fold would be a hole.
  bool two_sided(std::size_t face) const { return two_sided_[face] != 0; }
  const std::vector<std::uint8_t>& two_sided() const { return two_sided_; }  // by face

 private:
  bool bent_over(std::uint32_t face) const;
  void set_vertex(std::uint32_t vertex);
  void set_face(std::uint32_t face);

  ShellSurface shell_;
  double pushed_mm_, edge_mm_ = 0;  // the mean edge of a smooth skin
  std::uint64_t poses_ = 0;
  std::vector<SkinFold> folds_;
  std::vector<Eigen::Vector3d> proxy_positions_, next_vertices_;
  TriangleMesh posed_;
  std::vector<Eigen::Vector3d> normals_;                        // by vertex
  std::vector<std::array<Eigen::Vector3d, 3>> corner_normals_;  // by face, from the first pose on
  std::optional<VertexGradients> gradients_;                    // of a smooth skin
  std::vector<Eigen::Matrix3d> gradient_changes_;               // by vertex
  std::vector<ShellMatrix> matrices_;
  std::vector<std::uint32_t> revisions_;
  std::vector<std::uint8_t> two_sided_;
  VertexFaces faces_of_;
  std::vector<std::uint8_t> vertex_changed_, face_changed_;  // of scratch
};

// A shell matrix, each column in a register of its own: the fourth row is zero.
using ShellColumns = Eigen::Matrix<float, 4, 9>;

// One face of the shell's surface in one frame: its deformed shell matrix in the view's frame, in
// millimetres and multiplied by the intrinsics, so that a sample lands with 24 multiply-adds and
// one reciprocal.
struct FaceFrame {
  ShellColumns metric;     // camera millimetres
  ShellColumns pixel;      // pixel × depth, pixel × depth, depth
  bool two_sided = false;  // see PosedShell
  bool near = false;       // see kNearTexel_px
};

// Pixels of a texel from which on a face is seen from near. Between samples that lie side by side
// gaps open that are as wide as a texel, more than find_see_through() looks across, and skin behind
// them would show: the base layer is drawn beneath all of such a face. A matter of the face's depth
// alone, so that it holds where no sample of it lies in the view.
inline constexpr float kNearTexel_px = 3;

// All faces of the shell in one frame, and which of them moved since the last.
class PlacedFaces {
 public:
  // continued: the last placing was of the same shell for the same view, and its frame is gone on
  // with. Faces that stayed are not placed anew. texel_mm: of the cameras, on the surface.
  void place(const PosedShell& shell, const View& view, float texel_mm, bool continued);
  // Faces that look otherwise although they stayed where they were: set in `changed`, by face.
  void add_moved(std::span<const std::uint8_t> changed);

  std::size_t size() const { return frames_.size(); }
  const FaceFrame& operator[](std::size_t face) const { return frames_[face]; }
  std::span<const FaceFrame> all() const { return frames_; }
  // Whether only what moved is to be drawn, and whether a face did.
  bool continued() const { return continued_; }
  bool moved(std::size_t face) const { return !continued_ || moved_[face] != 0; }
  // Whether one of some patches' faces did.
  bool any_moved(const PatchTable& patches, std::size_t first, std::size_t last) const {
    for (; first < last; ++first)
      if (moved(patches.face(first))) return true;
    return false;
  }

 private:
  std::vector<FaceFrame> frames_;
  std::vector<std::uint32_t> revisions_;  // of the faces as they are placed
  std::vector<std::uint8_t> moved_;
  bool continued_ = false;
};

// A sample stands for pixels up to this many texels away along each map axis. Half a texel reaches
// the neighbour; the rest forgives a patch's plane for not being its surface. More would thicken
// silhouettes, which costs more than all that happens inside them: at 0.75 texels, or with half a
// pixel where texels are smaller than that, 5 dB over the union of both silhouettes.
inline constexpr float kReach = 0.65f;

enum class ChunkVisibility : std::uint8_t { drawn, faces_away, outside_view };

// One chunk in one frame. Offsets from a sample to a pixel's centre are shares of the sample's
// reach (kReach), so that −1…1 is what a sample stands for.
struct ChunkFrame {
  float u_x, u_y, v_x, v_y;  // offset per pixel
  float z_u, z_v;            // depth per offset
  int columns, rows;         // pixels to try per sample, ≥ 1
  PixelBox box;              // of all pixels it may touch, clipped to the view
  float nearest_mm;          // no depth of it is less
  ChunkVisibility visibility;
  // Its face is seen from near, and its middle faces away: the base layer alone draws it.
  bool left_to_base;

  bool operator==(const ChunkFrame&) const = default;
};

// A texel is drawn over at most this many pixels along each axis; nearer still, the base layer
// shows between the samples.
inline constexpr int kMostSplat = 64;

// Where patches lie in a frame, whichever their faces are: `count` of them from `first` on, at most
// kPatchBatch.
inline constexpr int kPatchBatch = 64;
void place_patches(const PatchTable& patches, std::size_t first, int count,
                   std::span<const FaceFrame> faces, const View& view, ChunkFrame* frames);

// The patch's outward normal at its middle, unnormalised, where a face's shell matrix puts it.
Eigen::Vector3d patch_normal(const Patch& patch, const ShellMatrix& face);

// Which parts of the last frame, of the same view, have to be drawn again: those that something
// that moved touches where it was or where it is now. In cells much smaller than tiles.
class DirtyCells {
 public:
  static constexpr int kCell_px = 16;

  void reset(int width, int height, bool all) {
    columns_ = (width + kCell_px - 1) / kCell_px;
    moved_.assign(std::size_t(columns_) * ((height + kCell_px - 1) / kCell_px), all);
  }
  // box: clipped to the picture. From any thread.
  void mark(const PixelBox& box) {
    each_block(box, kCell_px, kCell_px, [&](int x, int y) {
      // As std::atomic_ref, which not every standard library has yet.
      __atomic_store_n(&moved_[std::size_t(y) * columns_ + x], std::uint8_t{1}, __ATOMIC_RELAXED);
    });
  }
  // Round all moved cells within `tile`.
  PixelBox within(const PixelBox& tile) const {
    PixelBox moved;
    each_block(tile, kCell_px, kCell_px, [&](int x, int y) {
      if (moved_[std::size_t(y) * columns_ + x])
        moved = united(moved, {x * kCell_px, y * kCell_px, (x + 1) * kCell_px, (y + 1) * kCell_px});
    });
    return intersected(moved, tile);
  }

 private:
  int columns_ = 0;
  std::vector<std::uint8_t> moved_;
};

// What one camera does in one frame.
struct ActiveCamera {
  const SampleSet* set = nullptr;
  float weight = 0;  // its share in the view
  std::vector<ChunkFrame> chunks;
  TileLists tiles;  // chunks drawn, by tile
};

// What of the organ a frame shows.
struct VisibilitySummary {
  PixelBox box;                     // of all pixels that may show some
  std::vector<std::uint8_t> shown;  // by face: whether any of it is drawn
};

// The up to three cameras that the viewing manifold names for a view, their chunks placed, culled
// and listed by tile. Kept between frames for its memory.
class ActiveCameras {
 public:
  // Those of used_cameras(weights).
  void choose(SampleStore& store, const ViewWeights& weights);
  // Where faces are continued, the last placing was for the same cameras and view: chunks of those
  // that did not move stay, and what the others leave or enter is marked. Returns what of the
  // chunks is seen; their samples are added to the report.
  VisibilitySummary place(const PlacedFaces& faces, const View& view, const TileGrid& grid,
                          DirtyCells& cells, DrawReport& report);

  std::span<const ActiveCamera> all() const { return std::span(cameras_).first(count_); }
  // Mean size of a texel on the surface by the cameras' shares, so that it changes as they do:
  // without a step. 1 when there are no samples.
  float texel_mm() const;

 private:
  std::array<ActiveCamera, 3> cameras_;
  std::size_t count_ = 0;
};

}  // namespace organbake
