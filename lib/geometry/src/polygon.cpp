// SPDX-License-Identifier: Apache-2.0
// Polygons and strips as triangles, vertices welded, and colours made linear. A convex polygon is a
// fan; a concave one is cut ear by ear (Meisters 1975) with a grid over its reflex corners, since
// files hold outlines of a hundred thousand corners, for which testing all of them at every ear
// takes minutes.
#include "organbake/geometry/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <utility>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// Corners by the cell of a square grid that they lie in.
class CornerGrid {
 public:
  CornerGrid(const std::vector<Eigen::Vector2d>& points,
             const std::vector<std::uint32_t>& corners) {
    for (const std::uint32_t c : corners) box_.extend(points[c]);
    side_ = 1 + static_cast<int>(std::sqrt(static_cast<double>(corners.size())));
    cells_.resize(std::size_t(side_) * side_);
    for (const std::uint32_t c : corners) {
      const Eigen::Array2i at = cell_of(points[c]);
      cells_[std::size_t(at.y()) * side_ + at.x()].push_back(c);
    }
  }

  // Whether test(corner) holds for any in the cells that a box touches, which are counted.
  template <class Test>
  bool any_in(const Eigen::AlignedBox2d& box, std::size_t& cells, Test&& test) const {
    const Eigen::AlignedBox2d common = box.intersection(box_);
    if (common.isEmpty()) return false;
    const Eigen::Array2i first = cell_of(common.min()), last = cell_of(common.max());
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const auto& cell = cells_[std::size_t(y) * side_ + x];
        cells += 1 + cell.size();
        if (std::any_of(cell.begin(), cell.end(), test)) return true;
      }
    }
    return false;
  }

 private:
  Eigen::Array2i cell_of(const Eigen::Vector2d& point) const {
    const Eigen::Array2d size = box_.sizes().array().max(1e-300);
    const Eigen::Array2d at = side_ * ((point - box_.min()).array() / size);
    const auto in_grid = [this](double c) { return c > 0 ? std::min(c, side_ - 1.0) : 0.0; };
    return {static_cast<int>(in_grid(at.x())), static_cast<int>(in_grid(at.y()))};
  }

  Eigen::AlignedBox2d box_;
  int side_ = 1;
  std::vector<std::vector<std::uint32_t>> cells_;
};

// Cuts a polygon, seen along the axis that its normal is closest to, ear by ear (Meisters 1975).
// Only a corner that turns the other way can lie in an ear, and of those only such near it are
// looked at: for a hundred thousand corners it takes a fraction of a second instead of minutes.
class EarCutter {
 public:
  EarCutter(const std::vector<Eigen::Vector3d>& vertices, std::span<const std::uint32_t> polygon)
      : polygon_(polygon) {
    // Newell: twice the polygon's area as a vector, about its first corner to keep the digits.
    const Eigen::Vector3d& origin = vertices[polygon[0]];
    const auto n = static_cast<std::uint32_t>(polygon.size());
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (std::uint32_t i = 0; i < n; ++i)
      normal += (vertices[polygon[i]] - origin).cross(vertices[polygon[(i + 1) % n]] - origin);
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    Eigen::Index across = (axis + 1) % 3, up = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(across, up);
    for (std::uint32_t i = 0; i < n; ++i) {
      const Eigen::Vector3d from_origin = vertices[polygon[i]] - origin;
      flat_.emplace_back(from_origin[across], from_origin[up]);
      next_.push_back((i + 1) % n);
      before_.push_back((i + n - 1) % n);
    }
    is_cut_.resize(n);
    for (std::uint32_t i = 0; i < n; ++i)
      if (!bulges(i)) reflex_.push_back(i);
  }

  bool convex() const {
    return std::none_of(reflex_.begin(), reflex_.end(),
                        [this](std::uint32_t i) { return turn(before_[i], i, next_[i]) < 0; });
  }

  void cut(std::vector<Face>& faces) {
    const CornerGrid near(flat_, reflex_);
    const auto n = static_cast<std::uint32_t>(polygon_.size());
    // Each second corner first: ears side by side would become a fan of slivers.
    std::deque<std::uint32_t> candidates;
    for (const std::uint32_t first : {0u, 1u})
      for (std::uint32_t i = first; i < n; i += 2) candidates.push_back(i);
    std::uint32_t left = n, some = 0;
    for (std::size_t work = 0; left > 3;) {
      // A polygon that crosses itself may have no ear: then any corner is as good as another.
      std::uint32_t ear = some;
      if (!candidates.empty()) {
        ear = candidates.front();
        candidates.pop_front();
        if (is_cut_[ear] || (work < kMostWork && !is_ear(ear, near, work))) continue;
      }
      some = next_[ear];
      // To cut an ear changes only what its neighbours are.
      candidates.insert(candidates.end(), {before_[ear], some});
      cut(ear, faces);
      --left;
    }
    cut(some, faces);
  }

 private:
  // Positive where the polygon turns there as it does as a whole.
  double turn(std::uint32_t p, std::uint32_t q, std::uint32_t r) const {
    const Eigen::Vector2d a = flat_[q] - flat_[p], b = flat_[r] - flat_[q];
    return a.x() * b.y() - a.y() * b.x();
  }
  bool bulges(std::uint32_t i) const { return turn(before_[i], i, next_[i]) > 0; }

  bool is_ear(std::uint32_t i, const CornerGrid& near, std::size_t& work) const {
    if (!bulges(i)) return false;
    const std::uint32_t a = before_[i], c = next_[i];
    Eigen::AlignedBox2d box(flat_[a]);
    box.extend(flat_[i]).extend(flat_[c]);
    // One that was cut off does no harm: its ear lay within the polygon.
    return !near.any_in(box, work, [&](std::uint32_t other) {
      const Eigen::Vector2d& p = flat_[other];
      if (p == flat_[a] || p == flat_[i] || p == flat_[c]) return false;
      return turn(a, i, other) >= 0 && turn(i, c, other) >= 0 && turn(c, a, other) >= 0;
    });
  }

  void cut(std::uint32_t ear, std::vector<Face>& faces) {
    faces.push_back({polygon_[before_[ear]], polygon_[ear], polygon_[next_[ear]]});
    next_[before_[ear]] = next_[ear];
    before_[next_[ear]] = before_[ear];
    is_cut_[ear] = true;
  }

  // Where corners lie so that more of the grid had to be searched, the rest is cut as it comes.
  static constexpr std::size_t kMostWork = 100'000'000;

  std::span<const std::uint32_t> polygon_;
  std::vector<Eigen::Vector2d> flat_;         // by corner
  std::vector<std::uint32_t> next_, before_;  // of the corners that are left
  std::vector<bool> is_cut_;
  std::vector<std::uint32_t> reflex_;  // at first: an ear's cut only makes fewer of them
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

// Vertices that files keep once for each face become one again. Candidates are found by sorting
// along a slant direction, so that neighbours in space are neighbours in the list; only vertices of
// open edges are looked at, which keeps bodies that touch apart.

namespace {

constexpr double kNearShare = 1e-6;  // of the size: what single precision leaves of a place

std::vector<std::uint32_t> open_vertices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> vertices;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) vertices.insert(vertices.end(), {uses[0].low, uses[0].high});
  });
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

// Which vertex each becomes: the lowest of those within the tolerance (0 = at the same place).
std::vector<std::uint32_t> targets(const TriangleMesh& mesh, double tolerance_mm) {
  std::vector<std::uint32_t> target(mesh.vertices.size());
  std::iota(target.begin(), target.end(), 0u);
  std::vector<std::uint32_t> open = open_vertices(mesh);
  // Along a slant direction even a voxel box has hardly two corners side by side.
  const Eigen::Vector3d slant = Eigen::Vector3d(0.5377, 0.6131, 0.5788).normalized();
  // Worked out once: a product that is fused in one place and not in another differs from itself,
  // and an order of such numbers is none.
  std::vector<double> along;
  along.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) along.push_back(vertex.dot(slant));
  std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(along[a], a) < std::pair(along[b], b);
  });
  for (std::size_t i = 0; i < open.size(); ++i) {
    const Eigen::Vector3d& place = mesh.vertices[open[i]];
    if (target[open[i]] != open[i]) continue;
    for (std::size_t j = i + 1; j < open.size(); ++j) {
      const Eigen::Vector3d& other = mesh.vertices[open[j]];
      if (along[open[j]] - along[open[i]] > tolerance_mm) break;
      if (target[open[j]] != open[j]) continue;
      if ((other - place).norm() <= tolerance_mm) target[open[j]] = open[i];
    }
  }
  return target;
}

TriangleMesh merged(const TriangleMesh& mesh, const std::vector<std::uint32_t>& target) {
  TriangleMesh result;
  std::vector<Eigen::Vector3f> color_sum(mesh.colors.size(), Eigen::Vector3f::Zero());
  std::vector<float> count(mesh.vertices.size(), 0.0f);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    ++count[target[v]];
    if (!mesh.colors.empty()) color_sum[target[v]] += mesh.colors[v];
  }
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (target[v] != v) continue;
    number[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
    if (!mesh.colors.empty())
      result.colors.push_back(count[v] == 1 ? mesh.colors[v]
                                            : Eigen::Vector3f(color_sum[v] / count[v]));
  }
  for (Face face : mesh.faces) {
    for (std::uint32_t& v : face) v = number[target[v]];
    // Slivers that closed up are gone, and with them faces that had a repeated corner before.
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0])
      result.faces.push_back(face);
  }
  return result;
}

std::size_t weld_within(TriangleMesh& mesh, double tolerance_mm) {
  TriangleMesh welded = merged(mesh, targets(mesh, tolerance_mm));
  const std::size_t gone = mesh.vertices.size() - welded.vertices.size();
  if (gone > 0) mesh = std::move(welded);
  return gone;
}

struct EdgeCounts {
  std::size_t open = 0, crowded = 0;  // used by one face, by three or more
};
EdgeCounts count_edges(const TriangleMesh& mesh) {
  EdgeCounts counts;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    counts.open += uses.size() == 1;
    counts.crowded += uses.size() > 2;
  });
  return counts;
}

}  // namespace

WeldSummary weld(TriangleMesh& mesh) {
  WeldSummary summary;
  if (count_edges(mesh).open == 0) return summary;
  summary.exact = weld_within(mesh, 0);
  const EdgeCounts exact = count_edges(mesh);
  if (exact.open == 0) return summary;
  TriangleMesh close = mesh;
  const double tolerance_mm = kNearShare * bounds(mesh).diagonal();
  const std::size_t gone = weld_within(close, tolerance_mm);
  if (gone == 0) return summary;
  const EdgeCounts after = count_edges(close);
  if (after.open >= exact.open || after.crowded > exact.crowded) return summary;
  summary.near = gone;
  summary.tolerance_mm = tolerance_mm;
  mesh = std::move(close);
  return summary;
}

namespace {

// In float, as images are: geometry stands above image and its tables.
float linear(float c) { return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f); }

double full_scale(const std::vector<Eigen::Vector3d>& written, ColorScale scale) {
  if (scale == ColorScale::byte) return 255;
  if (scale == ColorScale::two_bytes) return 65535;
  double most = 0;
  for (const Eigen::Vector3d& c : written) most = std::max(most, c.maxCoeff());
  return most <= 1 ? 1 : most <= 255 ? 255 : 65535;
}

}  // namespace

std::vector<Eigen::Vector3f> linear_colors(const std::vector<Eigen::Vector3d>& written,
                                           ColorScale scale) {
  std::vector<Eigen::Vector3f> colors;
  for (const Eigen::Vector3d& w : written) colors.push_back(w.cast<float>());
  if (scale == ColorScale::linear) return colors;
  const auto full = static_cast<float>(full_scale(written, scale));
  for (Eigen::Vector3f& color : colors) color = (color / full).unaryExpr(&linear).eval();
  return colors;
}

std::vector<Eigen::Vector3f> vertex_from_face_colors(
    const std::vector<Face>& faces, const std::vector<Eigen::Vector3f>& face_colors,
    std::size_t vertex_count) {
  std::vector<Eigen::Vector3f> colors(vertex_count, Eigen::Vector3f::Zero());
  std::vector<float> uses(vertex_count, 0.0f);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t v : faces[f]) {
      colors[v] += face_colors[f];
      ++uses[v];
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) colors[v] /= std::max(uses[v], 1.0f);
  return colors;
}

}  // namespace organbake
