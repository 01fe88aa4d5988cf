// SPDX-License-Identifier: GPL-3.0-or-later
// Tetrahedra inside a proxy from a regular lattice of cubes, five each: well shaped whatever the
// proxy is, which Delaunay meshing of coarse, folded proxies is not. Cells that the surface cuts
// count by the share that is inside.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"
#include "tissue_parts.h"

namespace organbake {

// The five tetrahedra of a cube, told by the parity of its corners; mirror images in neighbouring
// cubes, so that their faces match.
namespace {

constexpr int kOpposite = 7;  // corner ^ 7 lies across the cube, corner ^ 1, 2, 4 along an axis

double distance_along(const Eigen::Vector3d& at, int corner, int axis) {
  return std::abs(at[axis] - (corner >> axis & 1));
}

bool is_odd(int corner) { return ((corner ^ corner >> 1 ^ corner >> 2) & 1) != 0; }

}  // namespace

// Of the middle tetrahedron: the corners that lie an even (odd) number of edges from corner 0.
int LatticeCell::middle_corner(int k) const {
  constexpr std::array<int, 4> kEven = {0, 3, 5, 6}, kOdd = {7, 4, 2, 1};
  return odd ? kOdd[k] : kEven[k];
}

std::array<int, 4> LatticeCell::corners(int tetrahedron) const {
  std::array<int, 4> result;
  bool positive = odd;
  if (tetrahedron == 0) {
    for (int k = 0; k < 4; ++k) result[k] = middle_corner(k);
  } else {
    const int own = middle_corner(tetrahedron - 1) ^ kOpposite;
    result = {own, own ^ 1, own ^ 2, own ^ 4};
    positive = !is_odd(own);  // x, y, z from corner 0 are right-handed, each flip mirrors
  }
  if (!positive) std::swap(result[2], result[3]);
  return result;
}

// The corner tetrahedron at c holds what is nearer to c than 1 by the sum of coordinates; the
// middle one's weight of a corner grows from 0 to 1 as that sum from the opposite corner does from
// 1 to 3.
LatticeCell::Location LatticeCell::locate(const Eigen::Vector3d& at) const {
  Location location;
  std::array<double, 8> weight{};
  for (int k = 0; k < 4; ++k) {
    const int own = middle_corner(k) ^ kOpposite;
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) sum += distance_along(at, own, axis);
    if (sum < 1) {
      location.tetrahedron = k + 1;
      weight.fill(0);
      for (int axis = 0; axis < 3; ++axis) {
        weight[own ^ 1 << axis] = distance_along(at, own, axis);
      }
      weight[own] = 1 - sum;
      break;
    }
    weight[middle_corner(k)] = (sum - 1) / 2;
  }
  const auto own = corners(location.tetrahedron);
  for (int k = 0; k < 4; ++k) location.weights[k] = std::clamp(weight[own[k]], 0.0, 1.0);
  return location;
}

namespace {

// Of the faces' areas; those of a closed surface sum up to nothing, of half a sphere to a half.
constexpr double kLeastOneWay = 0.4;

// Twice the faces' areas, as vectors along their normals.
Eigen::Vector3d sum_of_areas(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& [a, b, c] : mesh.faces)
    sum += (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
  return sum;
}

}  // namespace

bool is_sheet(const TriangleMesh& surface) {
  return sum_of_areas(surface).norm() > kLeastOneWay * 2 * surface_area(surface);
}

TriangleMesh tissue_layer(const TriangleMesh& sheet, double thickness_mm) {
  const auto below = static_cast<std::uint32_t>(sheet.vertices.size());
  const Eigen::Vector3d down = -thickness_mm * sum_of_areas(sheet).normalized();
  TriangleMesh layer{sheet.vertices, sheet.faces, {}};
  for (const Eigen::Vector3d& v : sheet.vertices) layer.vertices.push_back(v + down);
  for (const Face& f : sheet.faces)
    layer.faces.push_back({below + f[0], below + f[2], below + f[1]});
  MeshEdges(sheet).for_each([&](std::span<const EdgeUse> uses) {
    int up = 0;
    for (const EdgeUse& use : uses) up += use.up() ? 1 : -1;
    // As often as the sheet runs along it more one way than back.
    const auto [a, b] =
        up > 0 ? std::pair(uses[0].low, uses[0].high) : std::pair(uses[0].high, uses[0].low);
    for (int i = 0; i < std::abs(up); ++i) {
      layer.faces.push_back({b, a, below + a});
      layer.faces.push_back({b, below + a, below + b});
    }
  });
  return layer;
}

namespace {

// Lines are moved aside by these shares of the spacing: meshes made by hand have edges right
// where a regular grid has its lines, and whether such an edge is hit would hang on rounding.
constexpr double kAsideY = 1.31e-3, kAsideZ = 2.17e-3;

struct Crossing {
  double x_mm;
  int leaves;  // 1: out of the body, −1: into it
};
using Lines = std::vector<std::vector<Crossing>>;

double cross2(double ay, double az, double by, double bz) { return ay * bz - az * by; }

// Adds the face's crossings to the lines that its projection along x covers.
void cross_face(const TriangleMesh& mesh, const Face& face, const SampleGrid& grid, Lines& lines) {
  const Eigen::Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                        &c = mesh.vertices[face[2]];
  const double area = cross2(b.y() - a.y(), b.z() - a.z(), c.y() - a.y(), c.z() - a.z());
  if (area == 0) return;
  const Eigen::Vector3d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
  const Eigen::Vector3d first =
      grid.first_mm + grid.spacing_mm * Eigen::Vector3d(0, kAsideY, kAsideZ);
  const auto range = [&](int axis) {
    const double from = (low[axis] - first[axis]) / grid.spacing_mm;
    const double to = (high[axis] - first[axis]) / grid.spacing_mm;
    return std::pair(std::max(0, static_cast<int>(std::ceil(from))),
                     std::min(grid.count[axis] - 1, static_cast<int>(std::floor(to))));
  };
  const auto [j0, j1] = range(1);
  const auto [k0, k1] = range(2);
  for (int k = k0; k <= k1; ++k) {
    for (int j = j0; j <= j1; ++j) {
      const double y = first.y() + j * grid.spacing_mm, z = first.z() + k * grid.spacing_mm;
      const double u = cross2(y - a.y(), z - a.z(), c.y() - a.y(), c.z() - a.z()) / area;
      const double v = cross2(b.y() - a.y(), b.z() - a.z(), y - a.y(), z - a.z()) / area;
      if (u < 0 || v < 0 || u + v > 1) continue;
      const double x = a.x() + u * (b.x() - a.x()) + v * (c.x() - a.x());
      lines[std::size_t(k) * grid.count.y() + j].push_back({x, area > 0 ? 1 : -1});
    }
  }
}

void require_closed(const std::vector<Crossing>& line) {
  int sum = 0;
  for (const Crossing& c : line) sum += c.leaves;
  if (sum == 0) return;
  throw BadDataError(
      "the proxy is not closed, so it has no inside for tetrahedra; bake without them (fem: "
      "false), or close the surface");
}

constexpr double kCellsPerEdge = 0.75;
constexpr double kMostInner = 1000;  // cells, when their size is automatic
constexpr double kMostCells = 5e4;   // a quarter of a million tetrahedra: far from interactive
constexpr int kSamples = 12;         // per cell and axis; about 290 in a corner tetrahedron
constexpr double kLeastFill = 0.05;  // of cells that only a vertex or a sliver reaches into
constexpr double kWhole = 1e-9;      // a box of whole cells gets no further layer from rounding
constexpr double kNoWeight = 1e-9;   // a node that carries less of an anchor is no anchor
constexpr std::uint32_t kUnused = 0xFFFFFFFFu;

double automatic_cell(const TriangleMesh& proxy) {
  const double fewest = std::cbrt(std::abs(signed_volume(proxy)) / kMostInner);
  return std::max(kCellsPerEdge * mean_edge_length(proxy), fewest);
}

// The cells about the proxy, x fastest.
class Lattice {
 public:
  Lattice(const TriangleMesh& proxy, double cell_mm) : cell_mm_(cell_mm) {
    const Bounds box = bounds(proxy);
    const Eigen::Vector3d cells = ((box.max - box.min).array() / cell_mm - kWhole).ceil().max(1);
    if (!(cells.prod() <= kMostCells)) {
      throw UsageError("fem_cell_mm " + to_text(cell_mm) + " makes more than 50,000 cells of " +
                       "this proxy; it is " + to_text(box.diagonal(), 0) + " mm across");
    }
    count_ = cells.cast<int>();
    first_mm_ = box.center() - 0.5 * cell_mm * cells;
  }

  double cell_mm() const { return cell_mm_; }
  std::size_t cell_count() const { return std::size_t(count_.x()) * count_.y() * count_.z(); }
  std::size_t node_count() const { return (count_.array() + 1).cast<std::size_t>().prod(); }
  SampleGrid samples() const {
    const double spacing = cell_mm_ / kSamples;
    return {first_mm_.array() + 0.5 * spacing, spacing, kSamples * count_};
  }
  std::size_t cell(const Eigen::Vector3i& at) const {
    return (std::size_t(at.z()) * count_.y() + at.y()) * count_.x() + at.x();
  }
  Eigen::Vector3i cell_at(std::size_t cell) const {
    const auto index = static_cast<int>(cell);
    return {index % count_.x(), index / count_.x() % count_.y(), index / count_.x() / count_.y()};
  }
  // Place of a point, the tetrahedron counted over all cells.
  LatticeCell::Location locate(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d at = (point - first_mm_) / cell_mm_;
    const Eigen::Vector3i cell_of = at.array().floor().cast<int>().max(0).min(count_.array() - 1);
    const Eigen::Vector3d inside = (at - cell_of.cast<double>()).cwiseMax(0).cwiseMin(1);
    LatticeCell::Location found = cut(cell_of).locate(inside);
    found.tetrahedron += LatticeCell::kTetrahedra * static_cast<int>(cell(cell_of));
    return found;
  }
  std::array<std::uint32_t, 4> nodes(std::size_t tetrahedron) const {
    const Eigen::Vector3i at = cell_at(tetrahedron / LatticeCell::kTetrahedra);
    const auto corners = cut(at).corners(static_cast<int>(tetrahedron % LatticeCell::kTetrahedra));
    std::array<std::uint32_t, 4> result;
    for (int k = 0; k < 4; ++k) {
      const int c = corners[k];
      const Eigen::Vector3i n = at + Eigen::Vector3i(c & 1, c >> 1 & 1, c >> 2 & 1);
      result[k] =
          static_cast<std::uint32_t>((n.z() * (count_.y() + 1) + n.y()) * (count_.x() + 1) + n.x());
    }
    return result;
  }
  Eigen::Vector3d node(std::size_t index) const {
    const auto n = static_cast<int>(index);
    const int wide = count_.x() + 1, high = count_.y() + 1;
    return first_mm_ + cell_mm_ * Eigen::Vector3d(n % wide, n / wide % high, n / wide / high);
  }

 private:
  static LatticeCell cut(const Eigen::Vector3i& at) { return {(at.sum() & 1) != 0}; }

  double cell_mm_;
  Eigen::Vector3i count_;
  Eigen::Vector3d first_mm_;
};

// The share of every tetrahedron of the lattice that lies inside the proxy.
std::vector<double> fill_shares(const TriangleMesh& proxy, const Lattice& lattice) {
  const std::size_t count = LatticeCell::kTetrahedra * lattice.cell_count();
  std::vector<std::uint32_t> all(count, 0), within(count, 0);
  const SampleGrid grid = lattice.samples();
  const std::vector<std::uint8_t> inside = inside_samples(proxy, grid);
  for (int k = 0; k < grid.count.z(); ++k) {
    for (int j = 0; j < grid.count.y(); ++j) {
      for (int i = 0; i < grid.count.x(); ++i) {
        const auto t = static_cast<std::size_t>(
            lattice.locate(grid.first_mm + grid.spacing_mm * Eigen::Vector3d(i, j, k)).tetrahedron);
        ++all[t];
        within[t] += inside[grid.index(i, j, k)];
      }
    }
  }
  std::vector<double> shares(count, 0.0);
  for (std::size_t t = 0; t < count; ++t) shares[t] = all[t] > 0 ? double(within[t]) / all[t] : 0;
  return shares;
}

// Keeps the nodes that tetrahedra use, in the lattice's order.
void number_nodes(const Lattice& lattice, TetrahedralBody& body) {
  std::vector<std::uint32_t> number(lattice.node_count(), kUnused);
  for (const Tetrahedron& t : body.tetrahedra) {
    for (const std::uint32_t n : t.nodes) number[n] = 0;
  }
  for (std::size_t n = 0; n < number.size(); ++n) {
    if (number[n] == kUnused) continue;
    number[n] = static_cast<std::uint32_t>(body.nodes_mm.size());
    body.nodes_mm.push_back(lattice.node(n));
  }
  for (Tetrahedron& t : body.tetrahedra) {
    for (std::uint32_t& n : t.nodes) n = number[n];
  }
}

void anchor_nodes(const EmbeddedVertex& at, TetrahedralBody& body) {
  for (int k = 0; k < 4; ++k)
    if (at.weights[k] >= kNoWeight)
      body.anchors.push_back(body.tetrahedra[at.tetrahedron].nodes[k]);
}

// Points of a face, its corners left out, no farther apart than `step_mm`.
template <class Use>
void sample_face(const TriangleMesh& mesh, const Face& face, double step_mm, const Use& use) {
  const Eigen::Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                        &c = mesh.vertices[face[2]];
  const double longest = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  const int steps = static_cast<int>(std::ceil(longest / step_mm));
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; i + j <= steps; ++j)
      if (i < steps && j < steps && i + j > 0)
        use(Eigen::Vector3d(a + double(i) / steps * (b - a) + double(j) / steps * (c - a)));
}

// All nodes that hold an anchor, or a piece of skin between three of them: what is held is an area,
// whatever the size of the cells, and not points, about which finer cells would only turn.
void anchor_body(const TriangleMesh& proxy, const std::vector<std::uint32_t>& anchors,
                 const Lattice& lattice, const std::vector<std::uint32_t>& number,
                 TetrahedralBody& body) {
  std::vector<bool> held(proxy.vertices.size(), false);
  for (const std::uint32_t a : anchors) {
    held[a] = true;
    anchor_nodes(body.vertices[a], body);
  }
  for (const Face& face : proxy.faces) {
    if (!held[face[0]] || !held[face[1]] || !held[face[2]]) continue;
    sample_face(proxy, face, 0.5 * lattice.cell_mm(), [&](const Eigen::Vector3d& point) {
      const LatticeCell::Location at = lattice.locate(point);
      const std::uint32_t tetrahedron = number[at.tetrahedron];
      if (tetrahedron != kUnused) anchor_nodes({tetrahedron, at.weights}, body);
    });
  }
  std::sort(body.anchors.begin(), body.anchors.end());
  body.anchors.erase(std::unique(body.anchors.begin(), body.anchors.end()), body.anchors.end());
}

}  // namespace

std::vector<std::uint8_t> inside_samples(const TriangleMesh& mesh, const SampleGrid& grid) {
  Lines lines(std::size_t(grid.count.y()) * grid.count.z());
  for (const Face& face : mesh.faces) cross_face(mesh, face, grid, lines);
  std::vector<std::uint8_t> inside(grid.size(), 0);
  for (std::size_t l = 0; l < lines.size(); ++l) {
    std::vector<Crossing>& line = lines[l];
    require_closed(line);
    std::sort(line.begin(), line.end(),
              [](const Crossing& p, const Crossing& q) { return p.x_mm < q.x_mm; });
    int winding = 0;
    auto next = line.begin();
    for (int i = 0; i < grid.count.x(); ++i) {
      const double x = grid.first_mm.x() + i * grid.spacing_mm;
      for (; next != line.end() && next->x_mm <= x; ++next) winding -= next->leaves;
      inside[l * grid.count.x() + i] = winding != 0;
    }
  }
  return inside;
}

TetrahedralBody make_lattice_body(const TriangleMesh& proxy,
                                  const std::vector<std::uint32_t>& anchors, double cell_mm,
                                  const TriangleMesh& skin) {
  const Lattice lattice(proxy, cell_mm > 0 ? cell_mm : automatic_cell(proxy));
  std::vector<double> fill = fill_shares(proxy, lattice);
  TetrahedralBody body;
  for (const Eigen::Vector3d& v : proxy.vertices) {
    const LatticeCell::Location at = lattice.locate(v);
    body.vertices.push_back({static_cast<std::uint32_t>(at.tetrahedron), at.weights});
    double& share = fill[at.tetrahedron];
    share = std::max(share, kLeastFill);
  }
  std::vector<std::uint32_t> number(fill.size(), kUnused);
  for (std::size_t t = 0; t < fill.size(); ++t) {
    if (!(fill[t] > 0)) continue;
    number[t] = static_cast<std::uint32_t>(body.tetrahedra.size());
    body.tetrahedra.push_back({lattice.nodes(t), std::max(fill[t], kLeastFill)});
  }
  for (EmbeddedVertex& v : body.vertices) v.tetrahedron = number[v.tetrahedron];
  number_nodes(lattice, body);
  anchor_body(proxy, anchors, lattice, number, body);
  body.vertices.resize(skin.vertices.size());
  constexpr double kStepOfCell = 0.25;
  body.patches = skin_patches(skin, body, kStepOfCell * lattice.cell_mm(),
                              [&](const Eigen::Vector3d& point) -> std::optional<EmbeddedVertex> {
                                const LatticeCell::Location at = lattice.locate(point);
                                if (number[at.tetrahedron] == kUnused) return std::nullopt;
                                return EmbeddedVertex{number[at.tetrahedron], at.weights};
                              });
  return body;
}

std::size_t part_count(const TetrahedralBody& body) {
  UnionFind joined(body.nodes_mm.size());
  for (const Tetrahedron& t : body.tetrahedra)
    for (int k = 1; k < 4; ++k) joined.join(t.nodes[0], t.nodes[k]);
  std::size_t parts = 0;
  for (std::uint32_t n = 0; n < body.nodes_mm.size(); ++n) parts += joined.root(n) == n;
  return parts;
}

}  // namespace organbake
