// SPDX-License-Identifier: GPL-3.0-or-later
// The diameter of a point set by a dual walk over a tree of boxes: pairs of boxes that cannot hold
// two points farther apart than the best found are left out.
#include "organbake/decimate/largest_diameter.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <queue>
#include <span>
#include <utility>
#include <vector>

namespace organbake {
namespace {

constexpr double kPrecision = 1e-5;
constexpr std::size_t kFewPoints = 16;

// Points in the order of a tree of boxes: each box's points lie together, its halves side by side.
struct BoxedPoints {
  std::span<Eigen::Vector3d> points;
  Eigen::AlignedBox3d box;

  explicit BoxedPoints(std::span<Eigen::Vector3d> held) : points(held) {
    for (const Eigen::Vector3d& point : points) box.extend(point);
  }
  bool few() const { return points.size() <= kFewPoints; }
  // Halves itself along its longest side, which puts its points in another order.
  std::array<BoxedPoints, 2> halves() const {
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = points.size() / 2;
    std::nth_element(
        points.begin(), points.begin() + static_cast<std::ptrdiff_t>(middle), points.end(),
        [axis](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a[axis] < b[axis]; });
    return {BoxedPoints(points.first(middle)), BoxedPoints(points.subspan(middle))};
  }
};

struct Node {
  BoxedPoints held;
  int first_half = -1;  // of two that stand side by side; −1: not halved
};

double farthest(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return (a.max() - b.min()).cwiseAbs().cwiseMax((b.max() - a.min()).cwiseAbs()).norm();
}

class DiameterSearch {
 public:
  explicit DiameterSearch(std::vector<Eigen::Vector3d> points) : points_(std::move(points)) {
    build();
  }

  double search() {
    push(0, 0);
    while (!pairs_.empty() && pairs_.top().bound > (1 + kPrecision) * best_) {
      const Pair pair = pairs_.top();
      pairs_.pop();
      const Node &a = nodes_[std::size_t(pair.a)], &b = nodes_[std::size_t(pair.b)];
      if (a.first_half < 0 && b.first_half < 0) {
        compare(a.held.points, b.held.points);
        continue;
      }
      const bool halve_a =
          b.first_half < 0 ||
          (a.first_half >= 0 && a.held.box.diagonal().norm() >= b.held.box.diagonal().norm());
      const int half = halve_a ? a.first_half : b.first_half, other = halve_a ? pair.b : pair.a;
      push(half, other);
      push(half + 1, other);
    }
    return best_;
  }

 private:
  struct Pair {
    double bound;
    int a, b;
    bool operator<(const Pair& other) const { return bound < other.bound; }
  };

  void build() {
    nodes_.push_back({BoxedPoints(std::span(points_))});
    for (std::size_t at = 0; at < nodes_.size(); ++at) {
      if (nodes_[at].held.few()) continue;
      const auto halves = nodes_[at].held.halves();
      nodes_[at].first_half = static_cast<int>(nodes_.size());
      for (const BoxedPoints& half : halves) nodes_.push_back({half});
    }
  }

  // A point of each box is a distance found: what is best grows early, and much is never looked at.
  void push(int a, int b) {
    const BoxedPoints &first = nodes_[std::size_t(a)].held, &second = nodes_[std::size_t(b)].held;
    compare(first.points.first(1), second.points.first(1));
    const double bound = farthest(first.box, second.box);
    if (bound > (1 + kPrecision) * best_) pairs_.push({bound, a, b});
  }

  void compare(std::span<const Eigen::Vector3d> some, std::span<const Eigen::Vector3d> others) {
    for (const Eigen::Vector3d& p : some)
      for (const Eigen::Vector3d& q : others) best_ = std::max(best_, (p - q).norm());
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<Node> nodes_;
  std::priority_queue<Pair> pairs_;
  double best_ = 0;
};

}  // namespace

double largest_diameter_mm(const TriangleMesh& mesh) {
  if (mesh.vertices.size() < 2) return 0;
  return DiameterSearch(mesh.vertices).search();
}

}  // namespace organbake
