// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "gl.h"
#include "organbake/warp/organ_source.h"

namespace organbake {

// One camera's samples in one table, texel by texel: the slots' places, two a texel, their colours,
// and the patches, four texels each.
struct SampleTable {
  Table table{kWords};
  int first_color = 0, first_patch = 0, patches = 0;
  double texel_mm = 0;

  void take(const SampleSet& source);
};

// What graphics hardware holds of an organ, whole or as blades have cut it.
class OrganTables {
 public:
  // Of samples: those of a view are there in any case, and others that fit stay for the next views.
  static constexpr std::size_t kKept_bytes = 48'000'000;
  explicit OrganTables(std::size_t kept_bytes = kKept_bytes) : kept_bytes_(kept_bytes) {}

  Eigen::Vector3d origin;    // of the shell's numbers, world: they are small round it
  int faces = 0, steps = 0;  // steps of the base layer, 0: none

  // Whether it is this organ that it holds, as it lies.
  bool shows(std::uint64_t id, const std::vector<Eigen::Vector3d>& positions) const {
    return id_ == id && posed_ == positions;
  }
  // Begins a picture, whose samples() are asked for next. Uploads an organ that is another or cut
  // since the last one, and the pose unless it is the last one; how normals turn only where they
  // are lit.
  void pose(const OrganSource& source, const std::vector<Eigen::Vector3d>& positions, bool lit);
  // Until the next picture.
  const SampleTable& samples(Warper& warper, std::size_t camera);
  // For the programs that read the shell, the base layer's nodes, or the turns.
  void bind(const Program& program) const;
  std::size_t bytes() const;  // of samples

 private:
  void take_nodes(const OrganSource& source);

  std::uint64_t id_ = 0;
  int knots_ = 3, first_knot_ = 0;
  Table nodes_{kWords}, shells_{kFloats}, turns_{kFloats};
  struct Camera {
    SampleTable samples;
    std::uint64_t of = 0, used_in = 0;  // which id(); the last picture that asked for it
  };
  std::map<std::size_t, Camera> cameras_;
  std::size_t kept_bytes_;
  std::uint64_t picture_ = 0;
  std::vector<Eigen::Vector3d> posed_;
  std::uint64_t pose_ = 0;  // OrganSource::pose
  bool turned_ = false;     // turns_ is of the pose
  std::vector<Eigen::Matrix<float, 4, 7>> shell_texels_;
};

// What scales depths, of the farthest skin (mm), and of a texel on the nearest; and what fades.
struct PictureScale {
  float reach_mm = 0, texel_mm = 0;
  int fade_px = 0;     // of skin beside the background: SkinFinish::border_fade_px()
  bool relit = false;  // by another light than the baked one
  // Where the light at the scope is from the eye, mm, the view's frame; nothing by another light.
  std::optional<Eigen::Vector3f> scope_light_mm;
};

// A camera of a view, and its share there.
struct Layer {
  const SampleTable* samples = nullptr;
  float share = 0;
};

// An organ in one picture.
struct PlacedOrgan {
  const JointDrawing::Organ* organ;
  OrganSource source;
  OrganTables* tables;
  ViewWeights weights = {};
  std::vector<Layer> layers = {};
  DrawnLight light = DrawnLight::baked;
  double texel_mm = 1;
};

// The passes that graphics_drawing.h names up to the last, over all organs of a picture.
class OrganPasses {
 public:
  explicit OrganPasses(const Programs& programs);

  // Into Targets::resolved. Throws what Warper::draw() does, and GraphicsError.
  const Targets& draw(const std::vector<JointDrawing::Organ>& all, const View& view,
                      const DrawOptions& options);
  // Of the last picture.
  const ViewWeights& first_weights() const { return organs_.front().weights; }
  bool shows(const std::vector<JointDrawing::Organ>& all) const;  // these organs, as they lie
  const PictureScale& scale() const { return scale_; }

 private:
  void begin(const DrawOptions& options);
  const Program& begin_pass(const char* name, const PlacedOrgan& organ, const View& view) const;
  void place_patches(const PlacedOrgan& organ, const View& view);
  void splat_layers(const PlacedOrgan& organ, const View& view, bool skip_nearest);
  void draw_base(const PlacedOrgan& organ, const View& view);
  void resolve_layers(const PlacedOrgan& organ, const View& view, double reference_mm);

  // Patches as place.vert captured them, and how splat.vert reads them.
  struct PlacedPatches {
    BufferName buffer;
    VertexArrayName array;
    int room = 0;

    void reserve(int patches);
  };

  const Programs& programs_;
  VertexArrayName nothing_;  // for what is drawn by its vertices' numbers
  std::array<PlacedPatches, Targets::kLayers> placed_;
  Targets targets_;
  TextureName noise_;               // the grain's
  std::deque<OrganTables> tables_;  // of the organs, in their order
  std::vector<PlacedOrgan> organs_;
  PictureScale scale_;
};

}  // namespace organbake
