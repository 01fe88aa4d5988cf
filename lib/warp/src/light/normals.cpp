// SPDX-License-Identifier: Apache-2.0
// The normals of the base layer's lattice at rest, and how they turn with a bent shell.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "light/relit_skin.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/smooth_skin.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// One face's alone, not of unit length, added to its nodes'.
void add_face(const BaseLayer& layer, const ShellMatrix& shell, const float* height_mm,
              Vector3d* normals) {
  const std::uint32_t n = layer.steps;
  std::vector<Vector3d> points(layer.nodes_per_face());
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    points[node] = shell_point(shell, double(i) / n, double(j) / n, height_mm[node]);
  });
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vector3d normal = (points[b] - points[a]).cross(points[c] - points[a]);
    for (const std::uint32_t node : {a, b, c}) normals[node] += normal;
  };
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    if (i + j + 1 > n) return;
    const std::uint32_t down = base_node_index(n, i + 1, j), right = base_node_index(n, i, j + 1);
    add(node, down, right);
    if (i + j + 2 <= n) add(down, base_node_index(n, i + 1, j + 1), right);
  });
}

// Narrower than this share of a usual face, lattice triangles are so small that the rounding of
// their heights turns them about.
constexpr double kNarrow = 1.0 / 8;

double altitude(const TriangleMesh& proxy, std::uint32_t face) {
  const Face& f = proxy.faces[face];
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest = std::max(longest, (proxy.vertices[f[k]] - proxy.vertices[f[(k + 1) % 3]]).norm());
  return longest > 0 ? 2 * face_area(proxy, face) / longest : 0;
}

// Spreads the normals on a face's rim over its inner nodes, each of which becomes the mean of its
// neighbours.
void spread_rim(std::uint32_t steps, Vector3d* normals) {
  const auto at = [&](std::uint32_t i, std::uint32_t j) -> Vector3d& {
    return normals[base_node_index(steps, i, j)];
  };
  const auto each_inner = [&](auto&& visit) {
    for (std::uint32_t i = 1; i < steps; ++i)
      for (std::uint32_t j = 1; i + j < steps; ++j) visit(i, j);
  };
  const Vector3d corners = at(0, 0) + at(steps, 0) + at(0, steps);
  each_inner([&](std::uint32_t i, std::uint32_t j) { at(i, j) = corners.stableNormalized(); });
  for (std::uint32_t sweep = 0; sweep < steps; ++sweep) {
    each_inner([&](std::uint32_t i, std::uint32_t j) {
      at(i, j) = (at(i + 1, j) + at(i - 1, j) + at(i, j + 1) + at(i, j - 1) + at(i + 1, j - 1) +
                  at(i - 1, j + 1))
                     .stableNormalized();
    });
  }
}

constexpr int kCorners = 3, kMostPlaces = 6;

// b1, b2 of a face's places.
Vector2d place_on_face(int place) {
  static const std::array<Vector2d, kMostPlaces> places = {
      {{0, 0}, {1, 0}, {0, 1}, {0.5, 0.5}, {0, 0.5}, {0.5, 0}}};
  return places[place];
}

// (∂S/∂b1, ∂S/∂b2, ∂S/∂h) on the proxy.
Matrix3d tangents(const ShellMatrix& m, int place) {
  const Vector2d b = place_on_face(place);
  return shell_jacobian(m, b.x(), b.y(), 0);
}

Matrix3d cofactor(const Matrix3d& m) {
  Matrix3d columns;
  columns << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
  return columns;
}

// How sharply some faces bend where they meet, rad a mm: by how far their normals, of each twice
// its area, lean from their mean.
class MeetingFaces {
 public:
  void add(const Vector3d& normal) { sum_ += normal, areas_ += normal.norm(), ++count_; }
  double bend() const {
    const double along = areas_ > 0 ? std::min(1.0, sum_.norm() / areas_) : 1;
    return along < 1 ? 2 * std::sqrt((1 - along * along) * count_ / areas_) : 0;
  }

 private:
  Vector3d sum_ = Vector3d::Zero();
  double areas_ = 0;
  int count_ = 0;
};

}  // namespace

std::vector<Vector3d> lattice_normals(const BaseLayer& layer, const TriangleMesh& proxy) {
  const std::size_t per_face = layer.nodes_per_face();
  const std::vector<ShellMatrix> shells = shell_matrices(proxy);
  const Lattice lattice(proxy, layer.steps);
  std::vector<Vector3d> joined(lattice.node_count(), Vector3d::Zero());
  for (std::uint32_t f = 0; f < layer.face_count; ++f) {
    std::vector<Vector3d> own(per_face, Vector3d::Zero());
    add_face(layer, shells[f], &layer.height_mm[f * per_face], own.data());
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      joined[lattice.node(f, i, j)] += own[node];
    });
  }
  for (Vector3d& normal : joined) normal.stableNormalize();
  std::vector<Vector3d> normals;
  normals.reserve(layer.face_count * per_face);
  for (std::uint32_t f = 0; f < layer.face_count; ++f) {
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      normals.push_back(joined[lattice.node(f, i, j)]);
    });
  }
  const double narrow_mm =
      kNarrow *
      std::sqrt(2 * surface_area(proxy) / double(std::max<std::size_t>(1, proxy.faces.size())));
  for (std::uint32_t f = 0; f < layer.face_count; ++f)
    if (altitude(proxy, f) < narrow_mm) spread_rim(layer.steps, &normals[f * per_face]);
  return normals;
}

std::vector<Vector3d> cut_normals(const std::vector<Eigen::Vector3f>& uncut,
                                  const CutOrgan::FaceParts& parts, const TriangleMesh& cut,
                                  std::uint32_t steps) {
  const std::size_t per_face = base_node_index(steps, steps, 0) + 1;
  auto first_wall = static_cast<std::uint32_t>(uncut.size() / per_face);
  for (const auto& [face, pieces] : parts)
    for (const CutOrgan::FacePart& part : pieces) first_wall = std::max(first_wall, part.face + 1);
  std::vector<Vector3d> normals;
  for (const Eigen::Vector3f& normal : uncut) normals.push_back(normal.cast<double>());
  normals.resize(first_wall * per_face, Vector3d::Zero());
  for (const auto& [face, pieces] : parts) {
    const Eigen::Vector3f* whole = &uncut[face * per_face];
    for (const CutOrgan::FacePart& part : pieces) {
      CutOrgan::each_mixed_node(steps, part, [&](auto node, const LatticeMix& mix, auto&) {
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        for (int k = 0; k < 3; ++k) normal += mix.weights[k] * whole[mix.nodes[k]];
        normals[part.face * per_face + node] = normal.cast<double>().stableNormalized();
      });
    }
  }
  const std::vector<Vector3d> walls = CutOrgan::wall_normals(cut, first_wall, steps);
  normals.insert(normals.end(), walls.begin(), walls.end());
  return normals;
}

NormalTransport::NormalTransport(const ShellSurface& shell)
    : places_(shell.skin() ? kCorners : kMostPlaces),
      rest_(shell_matrices(shell.at_rest())),
      knots_of_face_(shell.at_rest().faces.size()) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers;  // by its two vertices
  for (std::uint32_t f = 0; f < knots_of_face_.size(); ++f) {
    const Face& face = shell.at_rest().faces[f];
    for (int place = 0; place < places_; ++place) {
      const bool corner = place < kCorners;
      const std::uint32_t a = face[corner ? place : (place + 1) % 3];
      const std::uint32_t b = face[corner ? place : (place + 2) % 3];
      const auto next = static_cast<std::uint32_t>(numbers.size());
      knots_of_face_[f][place] = numbers.try_emplace(std::minmax(a, b), next).first->second;
    }
  }
  knots_.resize(numbers.size());
  add_shares();
}

void NormalTransport::add_shares() {
  std::vector<double> areas(knots_.size(), 0);
  for (std::uint32_t f = 0; f < knots_of_face_.size(); ++f) {
    for (int place = 0; place < places_; ++place) {
      const Matrix3d rest = tangents(rest_[f], place);
      // Twice the area along the skin: a face folded over, or of no area, tells nothing.
      const double area = rest.determinant();
      if (!(area > 0)) continue;
      areas[knots_of_face_[f][place]] += area;
      knots_[knots_of_face_[f][place]].shares.push_back({f, place, rest.transpose()});
    }
  }
  for (std::size_t k = 0; k < knots_.size(); ++k)
    for (Share& share : knots_[k].shares) share.of_rest /= areas[k];
  borrow_shares();
  for (Knot& knot : knots_) {
    MeetingFaces faces;
    for (const Share& s : knot.shares) faces.add(cofactor(tangents(rest_[s.face], s.place)).col(2));
    knot.bend_at_rest = faces.bend();
  }
}

// A knot between slivers alone goes with the other knots of its faces.
void NormalTransport::borrow_shares() {
  std::vector<std::vector<std::uint32_t>> lenders(knots_.size());
  for (std::size_t f = 0; f < knots_of_face_.size(); ++f) {
    const auto own = knots_of(f);
    for (const std::uint32_t knot : own) {
      if (!knots_[knot].shares.empty()) continue;
      std::copy_if(own.begin(), own.end(), std::back_inserter(lenders[knot]),
                   [&](std::uint32_t other) { return !knots_[other].shares.empty(); });
    }
  }
  for (std::size_t k = 0; k < knots_.size(); ++k) {
    for (const std::uint32_t lender : lenders[k]) {
      for (Share share : knots_[lender].shares) {
        share.of_rest /= double(lenders[k].size());
        knots_[k].shares.push_back(share);
      }
    }
  }
}

void NormalTransport::place(const std::vector<ShellMatrix>& deformed,
                            const std::vector<std::uint8_t>& changed,
                            std::vector<std::uint8_t>& turned) {
  constexpr std::size_t kKnotGrain = 64, kFaceGrain = 1024;
  std::vector<std::uint8_t> knot_turned(knots_.size());
  const auto turn_knot = [&](std::size_t k) {
    Knot& knot = knots_[k];
    const auto has_changed = [&](const Share& s) { return changed[s.face] != 0; };
    if (std::none_of(knot.shares.begin(), knot.shares.end(), has_changed)) return;
    const Turn turn = mean_turn(knot, deformed);
    knot_turned[k] = turn != knot.turn;
    knot.turn = turn;
  };
  parallel_each(std::size_t{0}, knots_.size(), kKnotGrain, turn_knot);
  const auto any_turned = [&](std::size_t f) {
    const auto own = knots_of(f);
    return std::any_of(own.begin(), own.end(),
                       [&](std::uint32_t k) { return knot_turned[k] != 0; });
  };
  parallel_each(std::size_t{0}, turned.size(), kFaceGrain,
                [&](std::size_t f) { turned[f] = any_turned(f); });
}

NormalTransport::Turn NormalTransport::mean_turn(const Knot& knot,
                                                 const std::vector<ShellMatrix>& deformed) const {
  // To the bit, so that skin which stays keeps its light.
  const auto at_rest = [&](const Share& s) { return deformed[s.face] == rest_[s.face]; };
  if (std::all_of(knot.shares.begin(), knot.shares.end(), at_rest)) return Turn::Identity();
  Eigen::Matrix<double, 4, 3> mean = Eigen::Matrix<double, 4, 3>::Zero();
  MeetingFaces faces;
  for (const Share& s : knot.shares) {
    const Matrix3d now = cofactor(tangents(deformed[s.face], s.place));
    mean.topRows<3>() += now * s.of_rest;
    faces.add(now.col(2));
  }
  mean(3, 0) = std::max(0.0, faces.bend() - knot.bend_at_rest);
  return mean.cast<float>();
}

bool NormalTransport::at_rest(std::uint32_t face) const {
  const auto own = knots_of(face);
  return std::all_of(own.begin(), own.end(),
                     [&](std::uint32_t k) { return knots_[k].turn == Turn::Identity(); });
}

std::vector<NormalTransport::Turn> NormalTransport::turns() const {
  std::vector<Turn> all;
  for (const Knot& knot : knots_) all.push_back(knot.turn);
  return all;
}

NormalTransport::OnFace NormalTransport::on(std::uint32_t face) const {
  OnFace on;
  for (int place = 0; place < places_; ++place)
    on[place] = knots_[knots_of_face_[face][place]].turn;
  return on;
}

NormalTransport::Turn NormalTransport::at(const OnFace& on, float b1, float b2) const {
  const std::array<float, kCorners> b = {1 - b1 - b2, b1, b2};
  if (places_ == kCorners) return b[0] * on[0] + b[1] * on[1] + b[2] * on[2];
  Turn sum = Turn::Zero();
  for (int k = 0; k < kCorners; ++k) {
    sum += b[k] * (2 * b[k] - 1) * on[k];
    sum += 4 * b[(k + 1) % 3] * b[(k + 2) % 3] * on[kCorners + k];
  }
  return sum;
}

}  // namespace organbake
