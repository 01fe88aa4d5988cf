// SPDX-License-Identifier: Apache-2.0
// Says why a picture is empty: the eye is inside an organ, by the winding number of its proxy
// (solid angles; van Oosterom & Strackee 1983), or the lens touches skin that is too near to be
// drawn.
#include "organbake/player/eye_inside.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/text.h"
#include "organbake/geometry/refine.h"

namespace organbake {

bool eye_is_inside(const Player& player, const View& view) {
  const Eigen::Vector3d eye = view.camera.center_world_mm();
  constexpr double kSurelyInside = 0.75;  // of a whole turn; beside an open sheet it is half of one
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const std::vector<Eigen::Vector3d>& at = player.proxy_positions(o);
    double turns = 0;
    for (const auto& [i, j, k] : player.bundle_now(o).proxy.faces) {
      const Eigen::Vector3d a = at[i] - eye, b = at[j] - eye, c = at[k] - eye;
      const double la = a.norm(), lb = b.norm(), lc = c.norm();
      turns += std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    if (turns / (2 * std::numbers::pi) > kSurelyInside) return true;
  }
  return false;
}

namespace {

// How far the relief stands over a face of the skin at most, mm; as the base layer tells it.
double relief_mm(const BaseLayer& base, std::size_t face) {
  const std::size_t nodes = base.face_count == 0 ? 0 : base.nodes_per_face();
  double highest = 0;
  for (std::size_t n = face * nodes; n < std::min((face + 1) * nodes, base.height_mm.size()); ++n)
    highest = std::max(highest, double(base.height_mm[n]));
  return highest;
}

}  // namespace

bool lens_touches_skin(const Player& player, const View& view) {
  const Eigen::Vector3d eye = view.camera.center_world_mm();
  // Skin is drawn from the near plane on, which is farther away at the picture's corners.
  const double reach_mm = 2 * view.near_mm;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    const Bundle& now = player.bundle_now(o);
    const TriangleMesh skin = now.shell().posed(player.proxy_positions(o));
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      const auto& [i, j, k] = skin.faces[f];
      const Eigen::Vector3d &a = skin.vertices[i], &b = skin.vertices[j], &c = skin.vertices[k];
      const Eigen::Vector3d weights = nearest_on_triangle(eye, a, b, c);
      const Eigen::Vector3d nearest = weights[0] * a + weights[1] * b + weights[2] * c;
      if ((nearest - eye).norm() < reach_mm + relief_mm(now.base, f)) return true;
    }
  }
  return false;
}

std::optional<std::string> why_empty(const Player& player, const View& view,
                                     const DrawReport& report) {
  if (report.unchanged || report.sample_pixels + report.base_pixels > 0) return std::nullopt;
  const std::string go_back =
      ": go back, or leave at least " + to_text(kNearest_mm) + " mm between the lens and the skin";
  if (eye_is_inside(player, view))
    return "the eye is inside the organ, whose skin is seen from outside alone" + go_back;
  if (lens_touches_skin(player, view)) return "the lens touches the skin" + go_back;
  return std::nullopt;
}

}  // namespace organbake
