// SPDX-License-Identifier: Apache-2.0
// The skin of an organ cut along a sheet. A cut's border within a face follows the blade's way,
// with no more corners than its shape needs (Douglas & Peucker 1973): each is a vertex that has to
// be carried from then on.
#include "organbake/cutting/cut_skin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace organbake {
SkinInside::SkinInside(const TriangleMesh& skin, const MaterialGrid& grid, std::uint32_t first_rank)
    : grid_(grid), rank_(first_rank + static_cast<std::uint32_t>(skin.vertices.size())) {
  const std::vector<GridPoint> points = grid.snapped(skin.vertices, first_rank);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t f = 0; f < skin.faces.size(); ++f) {
    const auto& [a, b, c] = skin.faces[f];
    faces_.push_back({points[a], points[b], points[c]});
    boxes_.emplace_back(points[a]);
    boxes_.back().add(points[b]);
    boxes_.back().add(points[c]);
    sum += face_area(skin, f) * face_normal(skin, f);
  }
  // A closed skin's normals sum up to nothing, and any way out is as good; an open one is left
  // through its front.
  const Bounds box = bounds(skin);
  int axis = 0;
  sum.cwiseAbs().maxCoeff(&axis);
  far_mm_ = Eigen::Vector3d::Zero();
  far_mm_[axis] = (sum[axis] < 0 ? -2 : 2) * box.diagonal();
}

bool SkinInside::operator()(const Eigen::Vector3d& at_mm) const {
  const GridPoint from = grid_.snapped(at_mm, rank_);
  const GridPoint to = grid_.snapped(at_mm + far_mm_, rank_ + 1);
  GridBox box(from);
  box.add(to);
  bool inside = false;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (boxes_[f].meets(box) && crosses(from, to, faces_[f])) inside = !inside;
  }
  return inside;
}

namespace {

// Where sheets' lines of one stroke, between two of its places, meet a face: from the first place
// to the second, without what lies on the straight way between them to `within_mm`.
struct PathPoint {
  Eigen::Vector2d in_face;
  SheetPlace place;
};

using Corners = std::array<Eigen::Vector3d, 3>;

// Where a line of a stroke passes through a face.
std::optional<PathPoint> pierced(const Corners& face, const BladeLine& line, std::uint32_t stroke,
                                 double number) {
  const Eigen::Vector3d one = face[1] - face[0], other = face[2] - face[0];
  const Eigen::Vector3d normal = one.cross(other);
  for (int k = 0; k + 1 < BladeLine::kRows; ++k) {
    const Eigen::Vector3d way = line.points_mm[k + 1] - line.points_mm[k];
    const double rise = normal.dot(way);
    if (rise == 0) continue;
    const double share = normal.dot(face[0] - line.points_mm[k]) / rise;
    if (!(share >= 0 && share <= 1)) continue;
    const Eigen::Vector3d at = line.points_mm[k] + share * way - face[0];
    const Eigen::Vector2d b(at.cross(other).dot(normal) / normal.squaredNorm(),
                            one.cross(at).dot(normal) / normal.squaredNorm());
    if (b.x() > 0 && b.y() > 0 && b.sum() < 1) return PathPoint{b, {stroke, number, k + share}};
  }
  return std::nullopt;
}

// Douglas & Peucker 1973, on the points between the ends of `path`.
void simplify(const std::vector<Eigen::Vector3d>& path, std::size_t first, std::size_t last,
              double within_mm, std::vector<std::uint8_t>& keep) {
  if (last - first < 2) return;
  const Eigen::Vector3d way = path[last] - path[first];
  double farthest = within_mm;
  std::size_t most = first;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Eigen::Vector3d at = path[i] - path[first];
    const double share =
        way.squaredNorm() > 0 ? std::clamp(at.dot(way) / way.squaredNorm(), 0.0, 1.0) : 0;
    const double away = (at - share * way).norm();
    if (away > farthest) farthest = away, most = i;
  }
  if (most == first) return;
  keep[most] = 1;
  simplify(path, first, most, within_mm, keep);
  simplify(path, most, last, within_mm, keep);
}

std::vector<PathPoint> path_within(const Corners& face, const PathPoint& from, const PathPoint& to,
                                   const CutSheet& sheet, double within_mm) {
  if (from.place.stroke != to.place.stroke) return {};
  const std::vector<BladeLine>& stroke = sheet.strokes()[from.place.stroke];
  const double low = std::min(from.place.line, to.place.line);
  const double high = std::max(from.place.line, to.place.line);
  std::vector<PathPoint> points = {from};
  for (auto i = static_cast<std::size_t>(std::floor(low)) + 1;
       i < stroke.size() && static_cast<double>(i) < high; ++i) {
    const auto point = pierced(face, stroke[i], from.place.stroke, static_cast<double>(i));
    if (point) points.push_back(*point);
  }
  points.push_back(to);
  if (from.place.line > to.place.line) std::reverse(points.begin() + 1, points.end() - 1);
  std::vector<Eigen::Vector3d> path;
  for (const PathPoint& p : points) {
    path.push_back(face[0] + p.in_face.x() * (face[1] - face[0]) +
                   p.in_face.y() * (face[2] - face[0]));
  }
  std::vector<std::uint8_t> keep(points.size(), 0);
  simplify(path, 0, points.size() - 1, within_mm, keep);
  std::vector<PathPoint> kept;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    if (keep[i]) kept.push_back(points[i]);
  }
  return kept;
}

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPathWithin_mm = 0.1;
constexpr double kLeastPart = 2e-3;   // of a face's area; paths that would leave less stay straight
constexpr double kProbeShare = 0.98;  // of the way to the first place where an edge is cut
constexpr double kAside = 0.02;       // of the way from the border to the side's corners

// Those of whose edges one may be cut, in increasing order.
std::vector<std::uint32_t> crossed_faces(const TriangleMesh& skin, const EdgeCrossings& edges) {
  const std::vector<std::uint8_t> beside_cuts = edges.beside_cuts();
  std::vector<std::uint32_t> crossed;
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f) {
    const auto& [a, b, c] = skin.faces[f];
    if (beside_cuts[a] + beside_cuts[b] + beside_cuts[c] >= 2) crossed.push_back(f);
  }
  return crossed;
}

double doubled(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
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
    skin_.parts_[face_] = made_[0];
    skin_.parts_.insert(skin_.parts_.end(), made_.begin() + 1, made_.end());
  }

 private:
  struct Point {
    std::uint32_t vertex;
    Vector2d at;
  };
  Point corner(int k) const { return {corners_[k], kCornersInFace[k]}; }
  // The vertex on edge k (from corner k to the next) that belongs to a corner's side.
  Point on_edge(int k, int side) const {
    const auto& [edge, ends] = *cut_[k];
    const bool first = edges_.edge(edge)[0] == corners_[side];
    const double share = edges_[edge].share();
    const bool along = edges_.edge(edge)[0] == corners_[k];
    const double t = along ? share : 1 - share;
    return {first ? ends.first : ends.second,
            (1 - t) * kCornersInFace[k] + t * kCornersInFace[(k + 1) % 3]};
  }
  Vector3d world(const Vector2d& at) const {
    return points_[0] + at.x() * (points_[1] - points_[0]) + at.y() * (points_[2] - points_[0]);
  }
  void add(const Point& a, const Point& b, const Point& c) {
    made_.push_back({face_, {a.vertex, b.vertex, c.vertex}, {a.at, b.at, c.at}});
  }
  Point add_inner(const PathPoint& point, const Vector2d& toward, double aside, int side) {
    Vertex vertex;
    vertex.at_mm = world(point.in_face);
    vertex.side_mm = world((1 - aside) * point.in_face + aside * toward);
    vertex.on_border = true;
    vertex.corner = corners_[side];
    vertex.place = point.place;
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

  // Parts along a path from edge a–b to edge c–a; false when one of them would be too small.
  bool try_path(int a, int b, int c, const std::vector<PathPoint>& path) {
    std::vector<Vector2d> line = {on_edge(a, a).at};
    for (const PathPoint& p : path) line.push_back(p.in_face);
    line.push_back(on_edge(c, a).at);
    const std::size_t last = line.size() - 1;
    const double least = path.empty() ? -1 : kLeastPart;
    for (std::size_t i = 0; i < last; ++i) {
      if (!(doubled(kCornersInFace[a], line[i], line[i + 1]) > least)) return false;
    }
    // On the other side, b sees the line up to some place and c from there on.
    std::size_t best = last + 1;
    double best_least = least;
    for (std::size_t m = 0; m <= last; ++m) {
      double smallest = doubled(kCornersInFace[b], kCornersInFace[c], line[m]);
      for (std::size_t i = 0; i < last; ++i) {
        const Vector2d& eye = kCornersInFace[i < m ? b : c];
        smallest = std::min(smallest, doubled(eye, line[i + 1], line[i]));
      }
      if (smallest > best_least) best_least = smallest, best = m;
    }
    if (best > last) return false;
    std::vector<Point> near = {on_edge(a, a)}, far = {on_edge(a, b)};
    const Vector2d middle = 0.5 * (kCornersInFace[b] + kCornersInFace[c]);
    for (const PathPoint& p : path) {
      near.push_back(add_inner(p, kCornersInFace[a], kAside, a));
      far.push_back(add_inner(p, middle, kAside, b));
    }
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
      const PathPoint point{middle, place};
      // Cuts need not meet there: the corner's own tissue carries it.
      inner[k] = add_inner(point, kCornersInFace[k], 1, k);
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
    vertices_.push_back({v, v, false, 0, {}, Vector3d::Zero()});
  for (std::uint32_t f = 0; f < skin.faces.size(); ++f)
    parts_.push_back({f, skin.faces[f], kCornersInFace});
  const std::vector<std::uint32_t> crossed = crossed_faces(skin, edges);
  cut_edges(skin, edges, crossed);
  if (ends_.empty()) return;
  for (const std::uint32_t f : crossed) FaceCutter(*this, skin, edges, sheet, f).cut();
  draw_skin_back(*this, sheet, vertices_);
}

Vector3d CutSkin::normal_beside(const SkinBorder& border) const {
  const auto& [a, b, c] = parts_[border.face].corners;
  const Vector3d at = vertices_[a].on_cut_mm();
  return (vertices_[b].on_cut_mm() - at).cross(vertices_[c].on_cut_mm() - at).stableNormalized();
}

std::uint32_t CutSkin::add_vertex(const Vertex& vertex) {
  vertices_.push_back(vertex);
  return static_cast<std::uint32_t>(vertices_.size() - 1);
}

// An edge falls in two when a face beside it comes apart; its halves' ends are one when the other
// face does not.
void CutSkin::cut_edges(const TriangleMesh& skin, const EdgeCrossings& edges,
                        const std::vector<std::uint32_t>& crossed_faces) {
  std::map<std::uint32_t, std::vector<std::pair<std::uint32_t, bool>>> beside;  // faces: parted?
  for (const std::uint32_t f : crossed_faces) {
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
    const auto add = [&](std::uint32_t corner, double probe) {
      return add_vertex(
          {on(share), on(probe), true, corner, crossed.first.place, Vector3d::Zero()});
    };
    EdgeEnds ends{};
    // Where an edge is cut near its end it is parted a little farther in.
    ends.first = ends.second = add(a, kProbeShare * std::min(crossed.first.share, share));
    if (parted == static_cast<std::ptrdiff_t>(faces.size()))
      ends.second = add(b, 1 - kProbeShare * (1 - std::max(crossed.last.share, share)));
    ends_[edge] = ends;
  }
}

}  // namespace organbake
