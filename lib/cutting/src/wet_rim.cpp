// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/wet_rim.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace organbake {
namespace {

const Eigen::Array3d kThroughBlood(0.26, 0.09, 0.08);

// Which faces meet at each vertex.
std::vector<std::vector<std::uint32_t>> faces_around(const TriangleMesh& skin) {
  std::vector<std::vector<std::uint32_t>> around(skin.vertices.size());
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f)
    for (const std::uint32_t v : skin.faces[f]) around[v].push_back(f);
  return around;
}

std::vector<WetRim::Lip> lips_of(const TriangleMesh& skin, std::uint32_t face,
                                 const std::vector<CutOrgan::FacePart>& parts) {
  std::vector<WetRim::Lip> lips;
  for (const CutOrgan::FacePart& part : parts) {
    for (int k = 0; k < 3; ++k) {
      if (!part.lip[k]) continue;
      const Eigen::Vector3d from_mm = WetRim::place_mm(skin, face, part.at[(k + 1) % 3]);
      lips.push_back({from_mm, WetRim::place_mm(skin, face, part.at[(k + 2) % 3]) - from_mm});
    }
  }
  return lips;
}

double squared_distance(const WetRim::Lip& lip, const Eigen::Vector3d& place_mm) {
  const Eigen::Vector3d way_mm = place_mm - lip.from_mm;
  const double length2 = lip.along_mm.squaredNorm();
  const double share = length2 > 0 ? std::clamp(way_mm.dot(lip.along_mm) / length2, 0.0, 1.0) : 0.0;
  return (way_mm - share * lip.along_mm).squaredNorm();
}

}  // namespace

Eigen::Vector3d WetRim::place_mm(const TriangleMesh& skin, std::uint32_t face,
                                 const Eigen::Vector2d& at) {
  const Face& corners = skin.faces[face];
  return (1 - at.sum()) * skin.vertices[corners[0]] + at[0] * skin.vertices[corners[1]] +
         at[1] * skin.vertices[corners[2]];
}

WetRim::WetRim(const TriangleMesh& skin, const CutOrgan::FaceParts& parts)
    : lips_(skin.faces.size()) {
  const std::vector<std::vector<std::uint32_t>> around = faces_around(skin);
  for (const auto& [face, of_face] : parts) {
    const std::vector<Lip> lips = lips_of(skin, face, of_face);
    if (lips.empty()) continue;
    std::vector<std::uint32_t> faces;
    for (const std::uint32_t v : skin.faces[face])
      faces.insert(faces.end(), around[v].begin(), around[v].end());
    std::sort(faces.begin(), faces.end());
    faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
    for (const std::uint32_t f : faces) lips_[f].insert(lips_[f].end(), lips.begin(), lips.end());
  }
}

std::vector<WetRim::Lip> WetRim::near(const std::vector<Lip>& lips, const Eigen::Vector3d& place_mm,
                                      double distance_mm) {
  std::vector<Lip> near;
  std::copy_if(lips.begin(), lips.end(), std::back_inserter(near), [&](const Lip& lip) {
    return squared_distance(lip, place_mm) < distance_mm * distance_mm;
  });
  return near;
}

// All on the inner half of the rim, less and less on the outer; of pieces wider than the rim as
// much as it covers.
double WetRim::share(const std::vector<Lip>& lips, const Eigen::Vector3d& place_mm,
                     double piece_mm) {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const Lip& lip : lips) nearest2 = std::min(nearest2, squared_distance(lip, place_mm));
  const double most = piece_mm > kWidth_mm ? kWidth_mm / piece_mm : 1;
  return std::clamp(2 - 2 * std::sqrt(nearest2) / reach_mm(piece_mm), 0.0, most);
}

Eigen::Array3d WetRim::kept(double share) { return 1 - share * (1 - kThroughBlood); }

}  // namespace organbake
