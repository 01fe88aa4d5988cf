// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

class CutSkin;

// How far the lips of a cut stand apart that nothing pulls on: the skin of an organ is stretched
// at rest, and what was cut draws back. It is a matter of what is shown: the lips, the skin beside
// them and the walls below them are posed so before they are drawn, the tissue's own movement knows
// nothing of it, and a cut that is pulled open farther is shown as it is.
class LipGape {
 public:
  LipGape() = default;
  // A wall's vertex below a lip, by its share of the way down to the wall's deepest.
  struct Wall {
    std::uint32_t lip = 0;
    double down = 0;
  };
  // walls: of the vertices behind those of the skin. widest_mm: by half of it each lip draws back,
  // far from where the cut ends.
  LipGape(const CutSkin& skin, std::span<const Wall> walls, double widest_mm);

  // positions_mm: of CutOrgan::now()'s proxy, in any pose.
  void open(std::vector<Eigen::Vector3d>& positions_mm) const;

 private:
  struct Border {  // a piece of a lip, and the corner across from it of the skin's face there
    std::uint32_t from, to, inner;
  };
  struct Lip {
    std::uint32_t vertex, other;  // on the cut's other side
    double gape_mm;
  };
  struct Beside {  // goes with a lip
    std::uint32_t vertex;
    std::size_t lip;
    double share;
  };
  void find_lips(const CutSkin& skin, double widest_mm);
  void find_beside(const CutSkin& skin, double widest_mm);

  std::vector<Border> borders_;
  std::vector<Lip> lips_;
  std::vector<Beside> beside_;
};

}  // namespace organbake
