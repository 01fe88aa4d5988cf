// SPDX-License-Identifier: Apache-2.0
#pragma once

// Blood that wells out of cuts, and the smoke of a hook.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "organbake/cutting/cut_sheet.h"
#include "organbake/cutting/cut_skin.h"

namespace organbake {

// A bead of blood on skin, world mm, and the pool that it is the rim of on the wall below: much
// farther down that it reaches than along the skin.
struct BloodLine {
  Eigen::Vector3d from_mm, to_mm;
  Eigen::Vector3d outward, down_wall;  // unit; of the skin
  double from_radius_mm = 0, to_radius_mm = 0;

  bool operator==(const BloodLine& other) const = default;
};

struct SmokePuff {
  Eigen::Vector3d middle_mm;  // world
  double radius_mm = 0;
  double share = 0;  // of the light from behind its middle, that it takes

  bool operator==(const SmokePuff& other) const = default;
};

// How the cuts of an organ bleed: a thin line along each lip that is as wide as it gets after
// kWelling_s, wider where the wall below has vessels, and from some of those a few millimetres down
// the skin. A hook's current seals most. Looks alone: nothing of it flows or is felt.
class Bleeding {
 public:
  static constexpr double kWelling_s = 2;

  Bleeding() = default;
  // proxy: of CutOrgan::now(), at rest. walls: as for LipGape. down: unit, world; none of a cast,
  // whose lips are wet from the first and no more.
  Bleeding(const CutSkin& skin, const CutSheet& sheet, const TriangleMesh& proxy,
           const std::vector<LipGape::Border>& lips, std::span<const LipGape::Wall> walls,
           const std::optional<Eigen::Vector3d>& down);

  // What has welled up until a step, of steps of such a length. positions_mm: of that proxy as it
  // is drawn.
  void add_blood(const std::vector<Eigen::Vector3d>& positions_mm, double step, double step_s,
                 std::vector<BloodLine>& blood) const;

 private:
  static constexpr int kRunPieces = 4;
  struct Bound {  // to the skin
    Face corners;
    Eigen::Vector3d weights;
    Eigen::Vector3d at(const std::vector<Eigen::Vector3d>& positions_mm) const;
    Eigen::Vector3d outward(const std::vector<Eigen::Vector3d>& positions_mm) const;
  };
  struct Well {  // a place on a lip
    double since, radius_mm;
  };
  struct Lip {
    Face corners;                       // of the skin's face there: from, to, inner
    std::array<std::uint32_t, 2> down;  // from one of these to a vertex of the wall below it
    std::array<Well, 2> ends;
  };
  struct Run {
    double since;
    std::array<Bound, kRunPieces + 1> path;
    void lead(std::span<const Face> skin, const std::vector<Eigen::Vector3d>& rest_mm,
              const Eigen::Vector3d& down, double length_mm);
  };

  std::vector<Lip> lips_;
  std::vector<Run> runs_;
};

// The smoke of what hooks have swept in the last second and a half, where they stood. up: unit.
void add_smoke(const CutSheet& sheet, const Eigen::Vector3d& up, double step, double step_s,
               std::vector<SmokePuff>& smoke);

}  // namespace organbake
