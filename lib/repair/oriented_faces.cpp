// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/repair_steps.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "geometry/mesh_edges.h"
#include "raycast/ray_scene.h"

namespace organbake {
namespace {

struct Neighbour {
  std::uint32_t face;
  bool alike;  // both run along their edge in opposite directions, as they should
};

std::vector<std::vector<Neighbour>> neighbours_of(const TriangleMesh& mesh) {
  std::vector<std::vector<Neighbour>> neighbours(mesh.faces.size());
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() != 2) return;
    const bool alike = uses[0].up() != uses[1].up();
    neighbours[uses[0].face()].push_back({uses[1].face(), alike});
    neighbours[uses[1].face()].push_back({uses[0].face(), alike});
  });
  return neighbours;
}

void turn(Face& face) { std::swap(face[1], face[2]); }

struct Piece {
  std::vector<std::uint32_t> faces;
  bool closed = true;
  double volume = 0;
};

std::vector<Piece> pieces_of(const TriangleMesh& mesh) {
  const auto neighbours = neighbours_of(mesh);
  std::vector<bool> reached(mesh.faces.size(), false);
  std::vector<Piece> pieces;
  for (std::uint32_t start = 0; start < mesh.faces.size(); ++start) {
    if (reached[start]) continue;
    Piece& piece = pieces.emplace_back();
    piece.faces = {start};
    reached[start] = true;
    const Eigen::Vector3d origin = mesh.vertices[mesh.faces[start][0]];
    for (std::size_t i = 0; i < piece.faces.size(); ++i) {
      const std::uint32_t f = piece.faces[i];
      const Face& face = mesh.faces[f];
      piece.closed &= neighbours[f].size() == 3;
      piece.volume +=
          (mesh.vertices[face[0]] - origin)
              .dot((mesh.vertices[face[1]] - origin).cross(mesh.vertices[face[2]] - origin)) /
          6;
      for (const Neighbour& next : neighbours[f]) {
        if (reached[next.face]) continue;
        reached[next.face] = true;
        piece.faces.push_back(next.face);
      }
    }
  }
  return pieces;
}

// With corners of its own for every face: a piece of thousands must not take all vertices along.
TriangleMesh mesh_of(const TriangleMesh& mesh, const Piece& piece) {
  TriangleMesh part;
  for (const std::uint32_t f : piece.faces) {
    const auto first = static_cast<std::uint32_t>(part.vertices.size());
    for (const std::uint32_t v : mesh.faces[f]) part.vertices.push_back(mesh.vertices[v]);
    part.faces.push_back({first, first + 1, first + 2});
  }
  return part;
}

const Eigen::Vector3d& corner_of(const TriangleMesh& mesh, const Piece& piece) {
  return mesh.vertices[mesh.faces[piece.faces.front()][0]];
}

using PieceBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;

PieceBox box_with(const Bounds& box, std::uint32_t piece) {
  return {
      CGAL::Bbox_3(box.min.x(), box.min.y(), box.min.z(), box.max.x(), box.max.y(), box.max.z()),
      piece};
}

// For each piece the smaller ones that begin within its box. Only a larger one can hold another;
// that also settles which of two that cross holds the other.
std::vector<std::vector<std::uint32_t>> pieces_in_boxes(const TriangleMesh& mesh,
                                                        const std::vector<Piece>& pieces) {
  std::vector<PieceBox> boxes, corners;
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    Bounds box, corner;
    for (const std::uint32_t f : pieces[i].faces)
      for (const std::uint32_t v : mesh.faces[f]) box.add(mesh.vertices[v]);
    corner.add(corner_of(mesh, pieces[i]));
    boxes.push_back(box_with(box, i));
    corners.push_back(box_with(corner, i));
  }
  std::vector<std::vector<std::uint32_t>> within(pieces.size());
  const auto look = [&](const PieceBox& box, const PieceBox& corner) {
    const std::uint32_t holder = box.info(), i = corner.info();
    if (holder != i && std::abs(pieces[holder].volume) > std::abs(pieces[i].volume))
      within[holder].push_back(i);
  };
  CGAL::box_intersection_d(boxes.begin(), boxes.end(), corners.begin(), corners.end(), look);
  return within;
}

// By the number of faces behind one another along a slant ray.
bool inside(const RayScene& scene, const Eigen::Vector3d& point, double off_mm) {
  Ray ray;
  ray.origin = point;
  ray.direction = Eigen::Vector3d(0.4821, 0.6213, 0.6177).normalized();
  constexpr int kMostFaces = 10000;
  int crossed = 0;
  for (RayHit hit; crossed < kMostFaces; ++crossed) {
    scene.first_hits({&ray, 1}, {&hit, 1});
    if (hit.face == kNoHit) break;
    ray.t_min = hit.t + off_mm;
  }
  return crossed % 2 == 1;
}

}  // namespace

std::size_t wind_alike(TriangleMesh& mesh) {
  const auto neighbours = neighbours_of(mesh);
  enum class State : char { unseen, kept, turned };
  std::vector<State> state(mesh.faces.size(), State::unseen);
  std::size_t all_turned = 0;
  for (std::uint32_t start = 0; start < mesh.faces.size(); ++start) {
    if (state[start] != State::unseen) continue;
    std::vector<std::uint32_t> patch = {start};
    state[start] = State::kept;
    double kept_area = 0, turned_area = 0;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      const std::uint32_t f = patch[i];
      (state[f] == State::kept ? kept_area : turned_area) += face_area(mesh, f);
      for (const Neighbour& next : neighbours[f]) {
        if (state[next.face] != State::unseen) continue;
        const bool as_this = next.alike == (state[f] == State::kept);
        state[next.face] = as_this ? State::kept : State::turned;
        patch.push_back(next.face);
      }
    }
    const State minority = kept_area >= turned_area ? State::turned : State::kept;
    for (const std::uint32_t f : patch) {
      if (state[f] != minority) continue;
      turn(mesh.faces[f]);
      ++all_turned;
    }
  }
  return all_turned;
}

std::size_t turn_outward(TriangleMesh& mesh) {
  std::vector<Piece> closed = pieces_of(mesh);
  std::erase_if(closed, [](const Piece& piece) { return !piece.closed; });
  constexpr double kOff = 1e-6;
  const double off_mm = kOff * bounds(mesh).diagonal();
  const std::vector<std::vector<std::uint32_t>> in_box = pieces_in_boxes(mesh, closed);
  std::vector<bool> cavity(closed.size(), false);
  for (std::size_t holder = 0; holder < closed.size(); ++holder) {
    if (in_box[holder].empty()) continue;
    const RayScene scene(mesh_of(mesh, closed[holder]));
    for (const std::uint32_t i : in_box[holder])
      if (inside(scene, corner_of(mesh, closed[i]), off_mm)) cavity[i] = !cavity[i];
  }
  std::size_t turned = 0;
  for (std::size_t i = 0; i < closed.size(); ++i) {
    if ((closed[i].volume < 0) == cavity[i]) continue;
    for (const std::uint32_t f : closed[i].faces) turn(mesh.faces[f]);
    ++turned;
  }
  return turned;
}

}  // namespace organbake
