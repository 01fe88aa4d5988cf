// SPDX-License-Identifier: Apache-2.0
#include "cutting/cut_skin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPathWithin_mm = 0.1;
constexpr double kLeastPart = 2e-3;   // of a face's area; paths that would leave less stay straight
constexpr double kProbeShare = 0.98;  // of the way to the first place where an edge is cut
constexpr double kAside = 0.02;       // of the way from the border to the side's corners

constexpr double kFarthestBack = 0.5;  // of the way from where cuts meet to a corner
constexpr double kFlattest = 0.067;    // squared sine of the angle between a blade and the skin

const std::array<Vector2d, 3> kCornersAt = {Vector2d(0, 0), Vector2d(1, 0), Vector2d(0, 1)};

double doubled(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
}

// How far along a way, in parts of it, half of what a blade took away there reaches.
double taken_share(const CutSheet& sheet, const SheetPlace& place, const Vector3d& way_mm) {
  const double half_mm = 0.5 * sheet.width_mm(place.stroke);
  return half_mm == 0 ? 0 : half_mm / std::abs(sheet.across(place).dot(way_mm));
}

}  // namespace

std::vector<EdgeCrossings::Edge> edges_of(const std::vector<Face>& faces) {
  std::vector<EdgeCrossings::Edge> edges;
  edges.reserve(3 * faces.size());
  for (const auto& [a, b, c] : faces) edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
  return edges;
}

// One face on its way into parts.
class CutSkin::FaceCutter {
 public:
  FaceCutter(CutSkin& skin, const TriangleMesh& mesh, const EdgeCrossings& edges,
             const CutSheet& sheet, std::uint32_t face)
      : skin_(skin), edges_(edges), sheet_(sheet), face_(face), corners_(mesh.faces[face]) {
    for (int k = 0; k < 3; ++k) points_[k] = mesh.vertices[corners_[k]];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t edge = edges.index_of(corners_[k], corners_[(k + 1) % 3]);
      const auto ends = skin.ends_.find(edge);
      if (ends != skin.ends_.end()) cut_[k] = &*ends;
    }
  }

  void cut() {
    const int count = (cut_[0] != nullptr) + (cut_[1] != nullptr) + (cut_[2] != nullptr);
    if (count == 0) return;
    if (count == 1) halve();
    if (count == 2) cut_off();
    if (count == 3) cut_in_three();
    // The first of the parts keeps the face's number.
    std::vector<std::uint32_t>& numbers = skin_.parts_of_[face_];
    skin_.parts_[face_] = made_[0];
    numbers.push_back(face_);
    for (std::size_t i = 1; i < made_.size(); ++i) {
      numbers.push_back(static_cast<std::uint32_t>(skin_.parts_.size()));
      skin_.parts_.push_back(made_[i]);
    }
  }

 private:
  struct Point {
    std::uint32_t vertex;
    Vector2d at;
  };
  Point corner(int k) const { return {corners_[k], kCornersAt[k]}; }
  // The vertex on edge k (from corner k to the next) that belongs to a corner's side.
  Point on_edge(int k, int side) const {
    const auto& [edge, ends] = *cut_[k];
    const bool first = edges_.edge(edge)[0] == corners_[side];
    const double share = first ? ends.first_share : ends.second_share;
    const bool along = edges_.edge(edge)[0] == corners_[k];
    const double t = along ? share : 1 - share;
    return {first ? ends.first : ends.second,
            (1 - t) * kCornersAt[k] + t * kCornersAt[(k + 1) % 3]};
  }
  Vector3d world(const Vector2d& at) const {
    return points_[0] + at.x() * (points_[1] - points_[0]) + at.y() * (points_[2] - points_[0]);
  }
  void add(const Point& a, const Point& b, const Point& c) {
    made_.push_back({face_, {a.vertex, b.vertex, c.vertex}, {a.at, b.at, c.at}});
  }
  // Where the skin ends beside a place on the blade's path: by half the width that the blade took
  // away, along the skin; the sign says on which side.
  Vector2d beside(const PathPoint& point, double sign) const {
    const double half_mm = 0.5 * sheet_.width_mm(point.place.stroke);
    if (half_mm == 0) return point.in_face;
    const Vector3d one = points_[1] - points_[0], other = points_[2] - points_[0];
    const Vector3d normal = one.cross(other), across = sheet_.across(point.place);
    const Vector3d along = across - across.dot(normal) / normal.squaredNorm() * normal;
    // A blade that lies flat on the skin takes no more of it than one that stands at 15°.
    const Vector3d aside = sign * half_mm / std::max(along.squaredNorm(), kFlattest) * along;
    return point.in_face + Vector2d(aside.cross(other).dot(normal), one.cross(aside).dot(normal)) /
                               normal.squaredNorm();
  }
  Point add_inner(const PathPoint& point, const Vector2d& toward, double aside, int side) {
    Vertex vertex;
    vertex.at_mm = world(point.in_face);
    vertex.side_mm = world((1 - aside) * point.in_face + aside * toward);
    vertex.on_border = true;
    vertex.corner = corners_[side];
    vertex.place = point.place;
    vertex.face = face_;
    vertex.in_face = point.in_face;
    return {skin_.add_vertex(vertex), point.in_face};
  }
  void add_border(const Point& left_from, const Point& left_to, const Point& right_from,
                  const Point& right_to) {
    skin_.borders_.push_back(
        {face_, {left_from.vertex, left_to.vertex}, {right_from.vertex, right_to.vertex}});
  }

  // Where a cut ends on an edge: only the place on it is put in.
  void halve() {
    const int k = cut_[0] ? 0 : cut_[1] ? 1 : 2;
    const int next = (k + 1) % 3, last = (k + 2) % 3;
    add(corner(last), corner(k), on_edge(k, k));
    add(corner(last), on_edge(k, next), corner(next));
  }

  void cut_off() {
    const int other = !cut_[0] ? 0 : !cut_[1] ? 1 : 2;  // the edge that is whole
    const int a = (other + 2) % 3, b = other, c = (other + 1) % 3;
    const int edge_ab = a, edge_ca = c;
    std::vector<PathPoint> path = path_within(
        points_, {on_edge(edge_ab, a).at, skin_.vertices_[cut_[edge_ab]->second.first].place},
        {on_edge(edge_ca, a).at, skin_.vertices_[cut_[edge_ca]->second.first].place}, sheet_,
        kPathWithin_mm);
    if (!try_path(a, b, c, path)) {
      made_.clear();
      path.clear();
      try_path(a, b, c, path);
    }
  }

  // The path's points, as they lie on one side of it: on corner a's for +1, else on the other.
  std::vector<PathPoint> beside(int a, int b, const std::vector<PathPoint>& path,
                                double side) const {
    const SheetPlace& place = skin_.vertices_[cut_[a]->second.first].place;
    const bool to_a = sheet_.across(place).dot(points_[a] - points_[b]) > 0;
    std::vector<PathPoint> moved = path;
    for (PathPoint& p : moved) p.in_face = beside(p, to_a ? side : -side);
    return moved;
  }

  // Parts along a path from edge a–b to edge c–a; false when one of them would be too small.
  bool try_path(int a, int b, int c, const std::vector<PathPoint>& path) {
    const std::vector<PathPoint> at_a = beside(a, b, path, 1), beyond = beside(a, b, path, -1);
    std::vector<Vector2d> line = {on_edge(a, a).at}, far_line = {on_edge(a, b).at};
    for (const PathPoint& p : at_a) line.push_back(p.in_face);
    for (const PathPoint& p : beyond) far_line.push_back(p.in_face);
    line.push_back(on_edge(c, a).at), far_line.push_back(on_edge(c, c).at);
    const std::size_t last = line.size() - 1;
    const double least = path.empty() ? -1 : kLeastPart;
    for (std::size_t i = 0; i < last; ++i) {
      if (!(doubled(kCornersAt[a], line[i], line[i + 1]) > least)) return false;
    }
    // On the other side, b sees the line up to some place and c from there on.
    std::size_t best = last + 1;
    double best_least = least;
    for (std::size_t m = 0; m <= last; ++m) {
      double smallest = doubled(kCornersAt[b], kCornersAt[c], far_line[m]);
      for (std::size_t i = 0; i < last; ++i) {
        const Vector2d& eye = kCornersAt[i < m ? b : c];
        smallest = std::min(smallest, doubled(eye, far_line[i + 1], far_line[i]));
      }
      if (smallest > best_least) best_least = smallest, best = m;
    }
    if (best > last) return false;
    std::vector<Point> near = {on_edge(a, a)}, far = {on_edge(a, b)};
    const Vector2d middle = 0.5 * (kCornersAt[b] + kCornersAt[c]);
    for (const PathPoint& p : at_a) near.push_back(add_inner(p, kCornersAt[a], kAside, a));
    for (const PathPoint& p : beyond) far.push_back(add_inner(p, middle, kAside, b));
    near.push_back(on_edge(c, a)), far.push_back(on_edge(c, c));
    for (std::size_t i = 0; i < last; ++i) {
      add(corner(a), near[i], near[i + 1]);
      add(corner(i < best ? b : c), far[i + 1], far[i]);
      add_border(near[i], near[i + 1], far[i], far[i + 1]);
    }
    add(corner(b), corner(c), far[best]);
    return true;
  }

  // Where cuts meet: round the mean of the three places.
  void cut_in_three() {
    const Vector2d middle = (on_edge(0, 0).at + on_edge(1, 1).at + on_edge(2, 2).at) / 3;
    std::array<Point, 3> inner;
    const SheetPlace place = middle_place();
    for (int k = 0; k < 3; ++k) {
      // Away from the others', where tissue was taken.
      const double back = taken_share(sheet_, place, points_[k] - world(middle));
      const PathPoint point{middle + std::min(back, kFarthestBack) * (kCornersAt[k] - middle),
                            place};
      // Cuts need not meet there: the corner's own tissue carries it.
      inner[k] = add_inner(point, kCornersAt[k], 1, k);
    }
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3, last = (k + 2) % 3;
      add(corner(k), on_edge(k, k), inner[k]);
      add(corner(k), inner[k], on_edge(last, k));
      add_border(on_edge(k, k), inner[k], on_edge(k, next), inner[next]);
    }
  }

  // On the sheet that cuts two of the edges, half-way between them.
  SheetPlace middle_place() const {
    std::array<SheetPlace, 3> at;
    for (int k = 0; k < 3; ++k) at[k] = skin_.vertices_[cut_[k]->second.first].place;
    for (int k = 0; k < 3; ++k) {
      const SheetPlace& other = at[(k + 1) % 3];
      if (at[k].stroke == other.stroke)
        return {other.stroke, (at[k].line + other.line) / 2, (at[k].row + other.row) / 2};
    }
    return at[0];
  }

  CutSkin& skin_;
  const EdgeCrossings& edges_;
  const CutSheet& sheet_;
  std::uint32_t face_;
  Face corners_;
  std::array<Vector3d, 3> points_;
  std::array<const std::pair<const std::uint32_t, EdgeEnds>*, 3> cut_{};  // by edge
  std::vector<SkinPart> made_;
};

CutSkin::CutSkin(const TriangleMesh& skin, const EdgeCrossings& edges, const CutSheet& sheet) {
  for (const Vector3d& v : skin.vertices)
    vertices_.push_back({v, v, false, 0, {}, 0, Vector2d::Zero()});
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f)
    parts_.push_back({f, skin.faces[f], kCornersAt});
  cut_edges(skin, edges, sheet);
  if (ends_.empty()) return;
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f)
    FaceCutter(*this, skin, edges, sheet, f).cut();
}

std::uint32_t CutSkin::add_vertex(const Vertex& vertex) {
  vertices_.push_back(vertex);
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

// An edge falls in two when a face beside it comes apart; its halves' ends are one when the other
// face does not.
void CutSkin::cut_edges(const TriangleMesh& skin, const EdgeCrossings& edges,
                        const CutSheet& sheet) {
  std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, bool>>> beside;  // faces: parted?
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f) {
    std::array<std::uint32_t, 3> own;
    int count = 0;
    for (int k = 0; k < 3; ++k) {
      own[k] = edges.index_of(skin.faces[f][k], skin.faces[f][(k + 1) % 3]);
      count += edges.cut(own[k]);
    }
    for (int k = 0; count > 0 && k < 3; ++k) {
      if (edges.cut(own[k])) beside[own[k]].emplace_back(f, count >= 2);
    }
  }
  for (const auto& [edge, faces] : beside) {
    const auto parted = std::count_if(faces.begin(), faces.end(), [](auto& f) { return f.second; });
    if (parted == 0) continue;
    const auto [a, b] = edges.edge(edge);
    const EdgeCrossings::Crossed& crossed = edges[edge];
    const double share = crossed.share();
    const Vector3d &from = skin.vertices[a], &to = skin.vertices[b];
    const auto on = [&](double t) -> Vector3d { return (1 - t) * from + t * to; };
    const Face& f = skin.faces[faces.front().first];
    const auto add = [&](std::uint32_t corner, double at, double probe, const SheetPlace& place) {
      Vertex vertex{on(at), on(probe), true, corner, place, faces.front().first, Vector2d::Zero()};
      for (int k = 0; k < 3; ++k) {
        if (f[k] == a) vertex.in_face += (1 - at) * kCornersAt[k];
        if (f[k] == b) vertex.in_face += at * kCornersAt[k];
      }
      return add_vertex(vertex);
    };
    const bool apart = parted == static_cast<std::ptrdiff_t>(faces.size());
    constexpr double kLeast = EdgeCrossings::kLeastShare;
    EdgeEnds ends{0, 0, share, share};
    if (apart) {
      ends.first_share = std::max(std::min(share, kLeast),
                                  share - taken_share(sheet, crossed.first.place, to - from));
      ends.second_share = std::min(std::max(share, 1 - kLeast),
                                   share + taken_share(sheet, crossed.last.place, to - from));
    }
    // Where an edge is cut near its end it is parted a little farther in.
    ends.first = ends.second =
        add(a, ends.first_share, kProbeShare * std::min(crossed.first.share, ends.first_share),
            crossed.first.place);
    if (apart) {
      const double last = std::max(crossed.last.share, ends.second_share);
      ends.second = add(b, ends.second_share, 1 - kProbeShare * (1 - last), crossed.first.place);
    }
    ends_[edge] = ends;
  }
}

}  // namespace organbake
