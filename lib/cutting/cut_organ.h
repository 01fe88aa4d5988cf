// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bundle/bundle.h"
#include "cutting/blade_path.h"
#include "cutting/cut_body.h"
#include "cutting/cut_skin.h"
#include "cutting/skin_inside.h"

namespace organbake {

// A baked organ that blades cut. From the organ at rest and all that blades have swept so far it
// makes the organ as it is now, another bundle: its proxy is the skin, cut, and the walls of the
// cuts, every vertex carried by its own side's tetrahedra. It knows of no maps: the samples of the
// uncut organ stay, and are told by face_parts() to which of a cut face's parts they belong.
class CutOrgan {
 public:
  // Throws UsageError for an organ that was baked without tetrahedra. Keeps nothing by reference.
  explicit CutOrgan(const Bundle& bundle);

  // Which instrument's blade it is, and where it is now.
  struct BladeNow {
    std::size_t instrument;
    Blade blade;
  };
  // One step of the blades; those that are not among them are lifted. nodes_mm: where the nodes of
  // the body as it is now lie. Returns whether the organ hangs together otherwise now, or shows it.
  bool sweep(std::span<const BladeNow> blades, const std::vector<Eigen::Vector3d>& nodes_mm);
  bool cut() const { return cut_before_.has_value(); }

  // The organ as it is now; valid once something is cut.
  const Bundle& now() const { return now_; }
  // The parts of the uncut skin's cut faces, numbers of the faces of now().
  struct FacePart {
    std::uint32_t face;
    std::array<Eigen::Vector2d, 3> at;  // its corners in the uncut face: b1, b2
  };
  using FaceParts = std::map<std::uint32_t, std::vector<FacePart>>;
  const FaceParts& face_parts() const { return face_parts_; }
  // For each node of the body as it is now the one that it was before the last change.
  const std::vector<std::uint32_t>& node_sources() const { return node_sources_; }

  const CutBody& body() const { return body_; }
  const CutSheet& sheet() const { return sheet_; }
  const TriangleMesh& uncut_skin() const { return skin_; }

 private:
  void remake();
  void remake_body(const std::vector<TissuePlace>& places);
  void remake_base(const CutSkin& skin, std::size_t walls);
  void flatten_lips(const CutSkin& skin, const SkinPart& part, float* heights_mm) const;
  Eigen::Vector3f inner_color(std::uint32_t face, double b1, double b2) const;

  BaseLayer base_;  // of the uncut organ
  std::optional<Lighting> lighting_;
  TriangleMesh skin_;
  Eigen::Vector3f mean_albedo_ = Eigen::Vector3f::Constant(0.3f);
  CutBody body_;
  EdgeCrossings skin_edges_;
  SkinInside inside_;
  CutSheet sheet_;
  std::size_t taken_ = 0;  // triangles of the sheet
  std::map<std::size_t, BladePath> paths_;
  Bundle now_;
  FaceParts face_parts_;
  std::optional<CutTetrahedra> cut_before_;  // as now() has it
  std::vector<std::uint32_t> node_sources_;
};

}  // namespace organbake
