// SPDX-License-Identifier: Apache-2.0
#pragma once

// Trocars, through which tools come, and where a line crosses a triangle of skin.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/instruments/instrument.h"
#include "organbake/warp/view.h"

namespace organbake {

// How far along origin + t·direction the triangle lies, before (t > 0) or behind; nothing when it
// is missed.
inline std::optional<double> line_crossing(const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& direction,
                                           const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                           const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return std::nullopt;
  const Eigen::Vector3d from_a = origin - a, q = from_a.cross(ab);
  const double u = from_a.dot(p) / determinant, v = direction.dot(q) / determinant;
  constexpr double kEdge = -1e-9;  // nothing slips between two triangles
  if (u < kEdge || v < kEdge || u + v > 1 - kEdge) return std::nullopt;
  return ac.dot(q) / determinant;
}

// A tool at one moment of those that its trocar has to serve, and who looks at it then.
struct ToolMoment {
  Instrument tool;
  View view;
};

// Finds the places through which tools come to organs, once for all moments of a tool.
class TrocarChooser {
 public:
  // Of organs at rest; keeps nothing by reference. Throws BadDataError as Bundle::shell() does.
  explicit TrocarChooser(const std::vector<const Bundle*>& organs);

  // World mm. So far away that the tool's shaft turns by less than 30° between any two of the
  // moments. Of the places round the tool the one from which the shaft stands on the skin rather
  // than lies on it, is seen from its side, comes in from below or beside the picture, goes on from
  // the tool's own axis, and meets neither the organ, nor the eye, nor other tools; where no place
  // serves so well, the one that fails least. A tool of several moments that stands clear behind an
  // open sheet in the first comes from there. others_mm: shafts of other tools, from end to end.
  using Shaft = std::array<Eigen::Vector3d, 2>;
  Eigen::Vector3d choose(const std::vector<ToolMoment>& moments,
                         const std::vector<Shaft>& others_mm = {}) const;

 private:
  struct Sight;
  class Scene;

  TriangleMesh skin_;  // of all organs
  std::vector<Eigen::Vector3d> normals_;
  std::vector<bool> open_;  // by vertex: of an organ that is an open sheet, not closed
  double extent_mm_ = 0;
};

}  // namespace organbake
