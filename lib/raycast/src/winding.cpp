// SPDX-License-Identifier: GPL-3.0-or-later
// Which way the pieces of a mesh are wound: a closed piece tells by the sign of its volume, and
// whether it is a body or the wall of a cavity by how many others hold it, which rays from one of
// its points count.
#include "organbake/raycast/face_queries.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

// A piece with a hole is taken for closed up to this open_share, which is that of a ball that lacks
// a cap of 23°, if its volume is at least this share of a ball's of the same area.
constexpr double kAllButClosed = 0.04, kRound = 0.02;

// Whether a half-edge and its twin run against each other, as they should.
bool alike(const TriangleMesh& mesh, std::uint32_t h, std::uint32_t twin) {
  return mesh.faces[h / 3][h % 3] != mesh.faces[twin / 3][twin % 3];
}

Eigen::Vector3d middle_of(const TriangleMesh& mesh, std::uint32_t face) {
  const Face& f = mesh.faces[face];
  return (mesh.vertices[f[0]] + mesh.vertices[f[1]] + mesh.vertices[f[2]]) / 3;
}

// Volume, area and open_share of the faces that were gathered.
void measure(const TriangleMesh& mesh, MeshPiece& piece) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), vector = Eigen::Vector3d::Zero();
  for (const std::uint32_t f : piece.faces) middle += middle_of(mesh, f);
  middle /= static_cast<double>(piece.faces.size());
  for (const std::uint32_t f : piece.faces) {
    const Face& face = mesh.faces[f];
    const Eigen::Vector3d a = mesh.vertices[face[0]] - middle, b = mesh.vertices[face[1]] - middle,
                          c = mesh.vertices[face[2]] - middle;
    const Eigen::Vector3d doubled = (b - a).cross(c - a);
    piece.volume_mm3 += a.dot(b.cross(c)) / 6;
    piece.area_mm2 += doubled.norm() / 2;
    vector += doubled / 2;
  }
  piece.open_share = piece.area_mm2 > 0 ? vector.norm() / piece.area_mm2 : 1;
}

// Whether the sign of its volume tells its inside.
bool has_inside(const MeshPiece& piece) {
  if (piece.closed) return true;
  const double ball_mm3 = std::pow(piece.area_mm2, 1.5) / (6 * std::sqrt(M_PI));
  return piece.open_share <= kAllButClosed && std::abs(piece.volume_mm3) >= kRound * ball_mm3;
}

// Which of the closed pieces lie in which others.
class Nesting {
 public:
  Nesting(const TriangleMesh& mesh, const std::vector<MeshPiece>& pieces)
      : mesh_(mesh), pieces_(pieces), boxes_(pieces.size()), piece_of_face_(mesh.faces.size()) {
    for (std::uint32_t p = 0; p < pieces.size(); ++p)
      for (const std::uint32_t f : pieces[p].faces) {
        piece_of_face_[f] = p;
        for (const std::uint32_t v : mesh.faces[f]) boxes_[p].add(mesh.vertices[v]);
      }
  }

  // Whether each lies in an odd number of others.
  std::vector<char> walls_of_cavities() const {
    std::vector<char> walls(pieces_.size(), 0);
    if (!any_box_within_another()) return walls;
    const RayScene scene(mesh_);
    parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t p) {
      walls[p] = pieces_[p].closed && holders_of(scene, static_cast<std::uint32_t>(p)) % 2 == 1;
    });
    return walls;
  }

 private:
  // Only a larger one can hold another.
  bool may_hold(std::uint32_t holder, std::uint32_t piece) const {
    return holder != piece && pieces_[holder].closed &&
           std::abs(pieces_[holder].volume_mm3) > std::abs(pieces_[piece].volume_mm3) &&
           (boxes_[holder].min.array() <= boxes_[piece].min.array()).all() &&
           (boxes_[holder].max.array() >= boxes_[piece].max.array()).all();
  }

  // Rays are spared where they have nothing to tell; of very many pieces the search would cost
  // more.
  bool any_box_within_another() const {
    constexpr std::uint32_t kMany = 2000;
    const auto count = static_cast<std::uint32_t>(pieces_.size());
    if (count > kMany) return true;
    for (std::uint32_t p = 0; p < count; ++p)
      for (std::uint32_t holder = 0; holder < count; ++holder)
        if (pieces_[p].closed && may_hold(holder, p)) return true;
    return false;
  }

  std::size_t holders_of(const RayScene& scene, std::uint32_t piece) const {
    constexpr std::size_t kMostPoints = 32;
    constexpr double kAll = 0.9;  // but for rays that graze edges
    const auto& faces = pieces_[piece].faces;
    const std::size_t points = std::min(faces.size(), kMostPoints);
    std::map<std::uint32_t, std::size_t> inside;
    for (std::size_t i = 0; i < points; ++i) {
      const std::uint32_t face = faces[(2 * i + 1) * faces.size() / (2 * points)];
      for (const auto& [holder, crossed] : crossings(scene, piece, middle_of(mesh_, face), i))
        inside[holder] += crossed % 2;
    }
    return static_cast<std::size_t>(std::count_if(inside.begin(), inside.end(), [&](auto& one) {
      return static_cast<double>(one.second) >= kAll * static_cast<double>(points);
    }));
  }

  // How often a slant ray from the point crosses each piece that may hold this one.
  std::map<std::uint32_t, std::size_t> crossings(const RayScene& scene, std::uint32_t piece,
                                                 const Eigen::Vector3d& point,
                                                 std::size_t turn) const {
    static const std::array<Eigen::Vector3d, 3> kSlant = {Eigen::Vector3d(0.4821, 0.6213, 0.6177),
                                                          Eigen::Vector3d(-0.7314, 0.2871, -0.6187),
                                                          Eigen::Vector3d(0.2217, -0.8043, 0.5512)};
    constexpr double kOff = 1e-6, kRounding = 1e-12;
    constexpr int kMostFaces = 10000;
    Ray ray;
    ray.origin = point;
    ray.direction = kSlant[turn % kSlant.size()].normalized();
    const double off_mm = kOff * (boxes_[piece].max - boxes_[piece].min).norm();
    std::map<std::uint32_t, std::size_t> crossed;
    RayHit hit;
    for (int i = 0; i < kMostFaces; ++i) {
      scene.first_hits({&ray, 1}, {&hit, 1});
      if (hit.face == kNoHit) break;
      const std::uint32_t other = piece_of_face_[hit.face];
      if (may_hold(other, piece)) ++crossed[other];
      ray.t_min = hit.t + std::max(off_mm, kRounding * hit.t);
    }
    return crossed;
  }

  const TriangleMesh& mesh_;
  const std::vector<MeshPiece>& pieces_;
  std::vector<Bounds> boxes_;
  std::vector<std::uint32_t> piece_of_face_;
};

using Twins = std::vector<std::uint32_t>;  // as half_edge_twins() gives them

std::vector<MeshPiece> pieces_of(const TriangleMesh& mesh, const Twins& twins) {
  std::vector<bool> reached(mesh.faces.size(), false);
  std::vector<MeshPiece> pieces;
  for (std::uint32_t start = 0; start < mesh.faces.size(); ++start) {
    if (reached[start]) continue;
    MeshPiece& piece = pieces.emplace_back();
    piece.faces = {start};
    reached[start] = true;
    for (std::size_t i = 0; i < piece.faces.size(); ++i)
      for (std::uint32_t h = 3 * piece.faces[i], end = h + 3; h < end; ++h) {
        piece.closed &= twins[h] != kNoHalfEdge;
        if (twins[h] == kNoHalfEdge || reached[twins[h] / 3]) continue;
        reached[twins[h] / 3] = true;
        piece.faces.push_back(twins[h] / 3);
      }
    measure(mesh, piece);
  }
  return pieces;
}

bool all_alike(const TriangleMesh& mesh, const Twins& twins) {
  for (std::uint32_t h = 0; h < twins.size(); ++h)
    if (twins[h] != kNoHalfEdge && !alike(mesh, h, twins[h])) return false;
  return true;
}

std::size_t wind_alike(TriangleMesh& mesh, const Twins& twins) {
  if (all_alike(mesh, twins)) return 0;
  enum class State : char { unseen, kept, turned };
  std::vector<State> state(mesh.faces.size(), State::unseen);
  std::vector<std::uint32_t> to_turn, patch;
  for (std::uint32_t start = 0; start < mesh.faces.size(); ++start) {
    if (state[start] != State::unseen) continue;
    patch = {start};
    state[start] = State::kept;
    double kept_area = 0, turned_area = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const std::uint32_t f = patch[i];
      (state[f] == State::kept ? kept_area : turned_area) += face_area(mesh, f);
      for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h) {
        if (twins[h] == kNoHalfEdge || state[twins[h] / 3] != State::unseen) continue;
        const bool as_this = alike(mesh, h, twins[h]) == (state[f] == State::kept);
        state[twins[h] / 3] = as_this ? State::kept : State::turned;
        patch.push_back(twins[h] / 3);
      }
    }
    const State minority = kept_area >= turned_area ? State::turned : State::kept;
    std::copy_if(patch.begin(), patch.end(), std::back_inserter(to_turn),
                 [&](std::uint32_t f) { return state[f] == minority; });
  }
  turn_faces(mesh, to_turn);
  return to_turn.size();
}

std::string sentence(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

}  // namespace

std::vector<MeshPiece> pieces_of(const TriangleMesh& mesh) {
  return pieces_of(mesh, half_edge_twins(mesh));
}

void turn_faces(TriangleMesh& mesh, const std::vector<std::uint32_t>& faces) {
  for (const std::uint32_t f : faces) std::swap(mesh.faces[f][1], mesh.faces[f][2]);
}

std::size_t wind_alike(TriangleMesh& mesh) { return wind_alike(mesh, half_edge_twins(mesh)); }

TurnedFaces turn_outward(TriangleMesh& mesh) { return turn_outward(mesh, half_edge_twins(mesh)); }

TurnedFaces turn_outward(TriangleMesh& mesh, Twins twins) {
  TurnedFaces turned;
  turned.faces = wind_alike(mesh, twins);
  if (turned.faces > 0) twins = half_edge_twins(mesh);
  const std::vector<MeshPiece> pieces = pieces_of(mesh, twins);
  const std::vector<char> walls = Nesting(mesh, pieces).walls_of_cavities();
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    if (!has_inside(pieces[p]) || (pieces[p].volume_mm3 < 0) == (walls[p] != 0)) continue;
    turn_faces(mesh, pieces[p].faces);
    ++(walls[p] ? turned.inward : turned.outward);
  }
  return turned;
}

std::vector<std::string> TurnedFaces::sentences() const {
  std::vector<std::string> said;
  if (faces > 0)
    said.push_back(sentence(faces, "face that was wound against its neighbours turned",
                            "faces that were wound against their neighbours turned"));
  if (outward > 0)
    said.push_back(sentence(outward, "piece that was wound inside out turned outward",
                            "pieces that were wound inside out turned outward"));
  if (inward > 0)
    said.push_back(sentence(inward,
                            "piece that lies within another turned inward, as a cavity's wall",
                            "pieces that lie within others turned inward, as cavities' walls"));
  return said;
}

}  // namespace organbake
