// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/cutting/cut_organ.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The skin along the lips of cuts, wet with blood.
class WetRim {
 public:
  struct Lip {
    Eigen::Vector3d from_mm, along_mm;
  };

  // skin: of the uncut organ, at rest; of its faces those in `parts` are cut.
  WetRim(const TriangleMesh& skin, const CutOrgan::FaceParts& parts);

  // The lips that may be near, for each face of the uncut skin: its own and those around it.
  const std::vector<std::vector<Lip>>& lips() const { return lips_; }

  // A place in a face, b1 and b2.
  static Eigen::Vector3d place_mm(const TriangleMesh& skin, std::uint32_t face,
                                  const Eigen::Vector2d& at);
  // How far off lips wet what is measured in pieces of a size, a texel's say.
  static double reach_mm(double piece_mm) { return kWidth_mm + piece_mm / 2; }
  // Those of some lips that come as near as that to a place.
  static std::vector<Lip> near(const std::vector<Lip>& lips, const Eigen::Vector3d& place_mm,
                               double distance_mm);
  // How much of a piece of skin about a place is wet, 0 to 1.
  static double share(const std::vector<Lip>& lips, const Eigen::Vector3d& place_mm,
                      double piece_mm);
  // What comes back of the colour (linear red, green, blue) of skin of which so much is wet.
  static Eigen::Array3d kept(double share);

 private:
  static constexpr double kWidth_mm = 1.0;

  std::vector<std::vector<Lip>> lips_;
};

}  // namespace organbake
