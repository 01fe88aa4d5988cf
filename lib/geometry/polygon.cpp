// SPDX-License-Identifier: Apache-2.0
#include "geometry/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {
namespace {

using PolygonCorners = std::vector<std::uint32_t>;

class EarCutter {
 public:
  EarCutter(const std::vector<Eigen::Vector3d>& vertices, std::span<const std::uint32_t> polygon)
      : vertices_(vertices), left_(polygon.begin(), polygon.end()) {
    // Newell: twice the polygon's area as a vector, about its first corner to keep the digits.
    const Eigen::Vector3d& origin = vertices[left_[0]];
    for (std::size_t i = 0; i < left_.size(); ++i) {
      normal_ += (at(i) - origin).cross(at((i + 1) % left_.size()) - origin);
    }
  }

  // Of corners p, q, r: positive where the polygon turns as a whole does.
  double turn(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r) const {
    return (q - p).cross(r - q).dot(normal_);
  }
  bool convex() const {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (turn(at(i), at(next(i)), at(next(next(i)))) < 0) return false;
    }
    return true;
  }

  void cut(std::vector<Face>& faces) {
    while (left_.size() > 3) {
      // A polygon that crosses itself may have no ear: then any corner is as good as another.
      std::size_t ear = 0;
      while (ear < left_.size() && !is_ear(ear)) ++ear;
      if (ear == left_.size()) ear = 0;
      faces.push_back({left_[before(ear)], left_[ear], left_[next(ear)]});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    faces.push_back({left_[0], left_[1], left_[2]});
  }

 private:
  std::size_t next(std::size_t i) const { return (i + 1) % left_.size(); }
  std::size_t before(std::size_t i) const { return (i + left_.size() - 1) % left_.size(); }
  const Eigen::Vector3d& at(std::size_t i) const { return vertices_[left_[i]]; }

  bool is_ear(std::size_t i) const {
    const Eigen::Vector3d &a = at(before(i)), &b = at(i), &c = at(next(i));
    if (turn(a, b, c) <= 0) return false;
    return std::none_of(left_.begin(), left_.end(), [&](std::uint32_t other) {
      const Eigen::Vector3d& p = vertices_[other];
      if (p == a || p == b || p == c) return false;
      return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
    });
  }

  const std::vector<Eigen::Vector3d>& vertices_;
  PolygonCorners left_;
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
};

}  // namespace

void cut_polygon(const std::vector<Eigen::Vector3d>& vertices,
                 std::span<const std::uint32_t> polygon, std::vector<Face>& faces) {
  const bool all_known = std::all_of(polygon.begin(), polygon.end(),
                                     [&](std::uint32_t v) { return v < vertices.size(); });
  if (polygon.size() > 3 && all_known) {
    EarCutter cutter(vertices, polygon);
    if (!cutter.convex()) return cutter.cut(faces);
  }
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    faces.push_back({polygon[0], polygon[i - 1], polygon[i]});
  }
}

void cut_strip(std::span<const std::uint32_t> strip, std::vector<Face>& faces) {
  for (std::size_t i = 2; i < strip.size(); ++i) {
    Face face{strip[i - 2], strip[i - 1], strip[i]};
    if (i % 2 == 1) std::swap(face[0], face[1]);
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) faces.push_back(face);
  }
}

}  // namespace organbake
