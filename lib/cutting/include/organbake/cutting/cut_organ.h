// SPDX-License-Identifier: Apache-2.0
#pragma once

// An organ as blades have cut it: tissue, skin, walls, and what bleeds.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/cutting/bleeding.h"
#include "organbake/cutting/cut_body.h"
#include "organbake/cutting/cut_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct CutWalls;

// A baked organ that blades cut. From the organ at rest and what blades have swept through it it
// makes the organ as it is now, another bundle: its proxy is the skin, cut, and the walls of the
// cuts, every vertex carried by its own side's tetrahedra. It knows of no maps: the samples of the
// uncut organ stay, and are told by face_parts() to which of a cut face's parts they belong.
class CutOrgan {
 public:
  // Throws UsageError for an organ that was baked without tetrahedra. Keeps nothing by reference.
  explicit CutOrgan(const Bundle& bundle);

  // A sheet for blades, with nothing on it.
  CutSheet clean_sheet() const;
  // Comes apart where a sheet, that of the last time with more on it, has passed since. Returns
  // whether the organ hangs together otherwise now, or shows it.
  bool part(const CutSheet& sheet);
  bool cut() const { return cut_; }
  std::size_t bytes() const;  // of memory, about
  // How many of the sheet's triangles it has come apart by.
  std::size_t taken() const { return taken_; }

  // The organ as it is now; valid once something is cut.
  const Bundle& now() const { return now_; }
  // The parts of those faces of the uncut skin that are cut, or were halved beside a cut, or lie
  // next to such, by their numbers among the faces of now().
  struct FacePart {
    static constexpr double kAny_mm = 1e6;
    std::uint32_t face;
    std::array<Eigen::Vector2d, 3> at;  // its corners in the uncut face: b1, b2
    std::array<double, 3> from_lip_mm = {kAny_mm, kAny_mm, kAny_mm};  // how far its corners lie

    double away_mm(const Eigen::Vector2d& b) const {
      return (1 - b.sum()) * from_lip_mm[0] + b.x() * from_lip_mm[1] + b.y() * from_lip_mm[2];
    }
    // Of a height over the part. The lips lie on the skin itself, whatever the relief over it, as
    // the walls below them do: however they are bent, nothing opens between the two. Beside them it
    // is no higher than they are far.
    float limited(float height_mm, const Eigen::Vector2d& b) const {
      const auto most = static_cast<float>(std::abs(away_mm(b)));
      return std::clamp(height_mm, -most, most);
    }
  };
  // Visits a part's lattice nodes, visit(node, mix, b), by those of the uncut face.
  template <class Visit>
  static void each_mixed_node(std::uint32_t steps, const FacePart& part, Visit&& visit) {
    each_node(steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      const Eigen::Vector2d b(double(i) / steps, double(j) / steps);
      visit(node, lattice_mix(steps, within(part.at, b)), b);
    });
  }
  using FaceParts = std::map<std::uint32_t, std::vector<FacePart>>;
  const FaceParts& face_parts() const { return face_parts_; }

  // Smooth unit normals of walls, which are the faces of a cut proxy from first_wall on and share
  // no vertex with those before, by the nodes of a lattice on each: what their colours are lit by.
  static std::vector<Eigen::Vector3d> wall_normals(const TriangleMesh& cut,
                                                   std::uint32_t first_wall, std::uint32_t steps);

  // Of now()'s proxy, when it is drawn.
  const LipGape& gape() const { return gape_; }
  const Bleeding& bleeding() const { return bleeding_; }
  bool alive() const { return lighting_ && !lighting_->finish.grain.isZero(0); }  // not a cast

  const CutBody& body() const { return body_; }
  const SkinInside& inside() const { return inside_; }
  const TriangleMesh& uncut_skin() const { return skin_; }

 private:
  void remake(const CutSheet& sheet);
  void remake_face_parts(const CutSkin& skin);
  std::vector<TissuePlace> places_of(const CutSkin& skin, const CutWalls& walls) const;
  void remake_body(const std::vector<TissuePlace>& places);
  void remake_give(const CutSkin& skin, std::span<const LipGape::Wall> down);
  void remake_base(const CutWalls& walls);
  Eigen::Vector3f inner_albedo_of(const CutWalls& walls, std::size_t face, double b1,
                                  double b2) const;

  BaseLayer base_;  // of the uncut organ
  std::optional<Lighting> lighting_;
  TriangleMesh skin_;
  std::vector<std::vector<NodeShare>> carriers_;  // of the uncut skin's vertices: the proxy's
  Eigen::Vector3f mean_albedo_ = Eigen::Vector3f::Constant(0.3f);
  CutBody body_;
  FineSkin fine_skin_;
  SkinInside inside_;
  std::size_t taken_ = 0;  // triangles of the sheet
  Bundle now_;
  FaceParts face_parts_;
  LipGape gape_;
  Bleeding bleeding_;
  bool cut_ = false;
};

}  // namespace organbake
