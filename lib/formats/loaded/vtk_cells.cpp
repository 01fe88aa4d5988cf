// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's cells (vtkCellType.h) as triangles: polygons and strips as they are, and the outside of
// grids of solid cells, which are the faces that no two solids share. The order of each kind's
// nodes and faces is that of The VTK User's Guide, "VTK File Formats", figures 2 and 3.
#include "meshes/mesh_readers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>

#include "organbake/core/error.h"

namespace organbake {
namespace {

using Nodes = std::vector<std::uint8_t>;

// A kind of cell: its corners come first, then the nodes at the middles of edges, then those at the
// centres of faces.
struct CellKind {
  std::size_t nodes = 0;                             // 0: any number
  std::vector<Nodes> faces = {};                     // the corners of each
  std::vector<std::array<std::uint8_t, 2>> middles;  // the edge of each node after the corners
  Nodes centers = {};                                // of the first faces
  bool solid = true;
};

constexpr int kStrip = 6, kPolygon = 7, kPolyhedron = 42;

const std::map<int, CellKind>& cell_kinds() {
  static const std::vector<Nodes>
      kTetrahedron = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 2, 1}},
      kHexahedron = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                     {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}},
      kWedge = {{0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}, {0, 1, 2}, {3, 5, 4}},
      kPyramid = {{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
      kTriangle = {{0, 1, 2}}, kQuad = {{0, 1, 2, 3}};
  static const std::vector<std::array<std::uint8_t, 2>>
      kThree = {{0, 1}, {1, 2}, {2, 0}},
      kFour = {{0, 1}, {1, 2}, {2, 3}, {3, 0}},
      kOfTetrahedron = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}},
      kOfHexahedron = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                       {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
      kOfWedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
      kEndsOfWedge = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}},
      kOfPyramid = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 4}, {1, 4}, {2, 4}, {3, 4}};
  static const std::map<int, CellKind> kKinds = {
      // Points and lines have no faces.
      {1, {1, {}, {}}},
      {2, {0, {}, {}}},
      {3, {2, {}, {}}},
      {4, {0, {}, {}}},
      {21, {3, {}, {}}},
      {5, {3, kTriangle, {}, {}, false}},
      {kStrip, {0, {}, {}, {}, false}},
      {kPolygon, {0, {}, {}, {}, false}},
      {8, {4, {{0, 1, 3, 2}}, {}, {}, false}},
      {9, {4, kQuad, {}, {}, false}},
      {22, {6, kTriangle, kThree, {}, false}},
      {23, {8, kQuad, kFour, {}, false}},
      {28, {9, kQuad, kFour, {8}, false}},
      {30, {6, kQuad, {{0, 1}, {2, 3}}, {}, false}},
      {34, {7, kTriangle, kThree, {6}, false}},
      {10, {4, kTetrahedron, {}}},
      {11,
       {8,
        {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}},
        {}}},
      {12, {8, kHexahedron, {}}},
      {13, {6, kWedge, {}}},
      {14, {5, kPyramid, {}}},
      {15,
       {10,
        {{0, 4, 3, 2, 1},
         {5, 6, 7, 8, 9},
         {0, 1, 6, 5},
         {1, 2, 7, 6},
         {2, 3, 8, 7},
         {3, 4, 9, 8},
         {4, 0, 5, 9}},
        {}}},
      {16,
       {12,
        {{0, 5, 4, 3, 2, 1},
         {6, 7, 8, 9, 10, 11},
         {0, 1, 7, 6},
         {1, 2, 8, 7},
         {2, 3, 9, 8},
         {3, 4, 10, 9},
         {4, 5, 11, 10},
         {5, 0, 6, 11}},
        {}}},
      {24, {10, kTetrahedron, kOfTetrahedron}},
      {25, {20, kHexahedron, kOfHexahedron}},
      {26, {15, kWedge, kOfWedge}},
      {27, {13, kPyramid, kOfPyramid}},
      {29, {27, kHexahedron, kOfHexahedron, {20, 21, 22, 23, 24, 25}}},
      {31, {12, kWedge, kEndsOfWedge}},
      {32, {18, kWedge, kOfWedge, {15, 16, 17}}},
      {33, {24, kHexahedron, kOfHexahedron, {20, 21, 22, 23}}}};
  return kKinds;
}

const CellKind& checked_kind(std::size_t cell, double written, std::size_t corners,
                             const std::string& name) {
  const int number = written >= 0 && written < 256 ? static_cast<int>(written) : -1;
  const std::string what =
      name + ": cell " + std::to_string(cell) + " is of kind " + std::to_string(number);
  if (number == kPolyhedron)
    throw BadDataError(name + ": holds polyhedra; save its surface (ParaView: Extract Surface)");
  const auto kind = cell_kinds().find(number);
  if (kind == cell_kinds().end())
    throw BadDataError(what + ", which is not read; save its surface (ParaView: Extract Surface)");
  const std::size_t needs = kind->second.nodes;
  if (corners == 0 || (needs > 0 && corners != needs))
    throw BadDataError(what + " and has " + std::to_string(corners) + " corners");
  return kind->second;
}

// Appends a face of a cell, through the nodes at the middles of its edges and at its centre.
class FaceCutter {
 public:
  FaceCutter(const CellKind& kind, std::span<const std::uint32_t> cell, std::size_t face)
      : kind_(kind), cell_(cell), corners_(kind.faces[face]) {
    if (face < kind.centers.size()) center_ = cell[kind.centers[face]];
  }

  void append(const std::vector<Eigen::Vector3d>& points, std::vector<Face>& faces) const {
    const std::size_t n = corners_.size();
    std::vector<std::uint32_t> corners, middles;
    for (std::size_t i = 0; i < n; ++i) {
      corners.push_back(cell_[corners_[i]]);
      middles.push_back(middle(corners_[i], corners_[(i + 1) % n]));
    }
    const auto none = static_cast<std::size_t>(std::count(middles.begin(), middles.end(), kNone));
    if (none == n) return cut_polygon(points, corners, faces);
    if (none > 0) return append_halves(corners, middles, points, faces);
    for (std::size_t i = 0; i < n; ++i) {
      const std::uint32_t before = middles[(i + n - 1) % n];
      if (center_ == kNone) {
        faces.push_back({before, corners[i], middles[i]});
      } else {
        faces.push_back({center_, before, corners[i]});
        faces.push_back({center_, corners[i], middles[i]});
      }
    }
    if (center_ == kNone) cut_polygon(points, middles, faces);
  }

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t middle(std::uint8_t a, std::uint8_t b) const {
    for (std::size_t m = 0; m < kind_.middles.size(); ++m) {
      const auto& edge = kind_.middles[m];
      if (edge == std::array{a, b} || edge == std::array{b, a})
        return cell_[kind_.nodes - later_nodes() - kind_.middles.size() + m];
    }
    return kNone;
  }
  // Those at centres: of faces, and of a hexahedron of 27 nodes its own.
  std::size_t later_nodes() const { return kind_.centers.size() + (kind_.nodes == 27 ? 1 : 0); }

  // Four corners of which two opposite edges have middles: two quads.
  static void append_halves(const std::vector<std::uint32_t>& c,
                            const std::vector<std::uint32_t>& m,
                            const std::vector<Eigen::Vector3d>& points, std::vector<Face>& faces) {
    const std::size_t i = m[0] != kNone ? 0 : 1;
    const std::array first = {c[i], m[i], m[i + 2], c[(i + 3) % 4]},
                     second = {m[i], c[i + 1], c[i + 2], m[i + 2]};
    cut_polygon(points, first, faces);
    cut_polygon(points, second, faces);
  }

  const CellKind& kind_;
  std::span<const std::uint32_t> cell_;
  const Nodes& corners_;
  std::uint32_t center_ = kNone;
};

// Programs do not agree on the order of a wedge's corners, so that a solid's faces are turned away
// from its middle whatever it is.
void turn_from_middle(const std::vector<Eigen::Vector3d>& points,
                      std::span<const std::uint32_t> nodes, std::span<Face> faces) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t node : nodes) middle += points[node] / double(nodes.size());
  double outward = 0;
  for (const Face& face : faces) {
    const Eigen::Vector3d a = points[face[0]] - middle, b = points[face[1]] - middle,
                          c = points[face[2]] - middle;
    outward += a.dot(b.cross(c));
  }
  if (outward >= 0) return;
  for (Face& face : faces) std::swap(face[1], face[2]);
}

// A face of a cell, known by its four lowest corners.
struct CellFace {
  std::array<std::uint32_t, 4> key;
  std::uint32_t cell;
  std::uint8_t face;
  bool solid;
};

CellFace face_of(std::span<const std::uint32_t> corners, std::size_t cell, std::size_t face,
                 bool solid) {
  CellFace found{{}, static_cast<std::uint32_t>(cell), static_cast<std::uint8_t>(face), solid};
  found.key.fill(std::numeric_limits<std::uint32_t>::max());
  std::partial_sort_copy(corners.begin(), corners.end(), found.key.begin(), found.key.end());
  return found;
}

// Which of them are seen from outside: those that one solid alone has, and flat ones that are no
// solid's.
std::vector<bool> outer(const std::vector<CellFace>& faces) {
  std::vector<std::uint32_t> order(faces.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return faces[a].key < faces[b].key; });
  std::vector<bool> shown(faces.size(), false);
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    std::size_t solids = 0;
    for (end = begin; end < order.size() && faces[order[end]].key == faces[order[begin]].key; ++end)
      solids += faces[order[end]].solid;
    for (std::size_t i = begin; i < end; ++i)
      shown[order[i]] = faces[order[i]].solid ? solids == 1 : solids == 0;
  }
  return shown;
}

void drop_unused_points(TriangleMesh& mesh) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  for (const Face& face : mesh.faces)
    for (const std::uint32_t v : face) number[v] = 0;
  std::uint32_t used = 0;
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == kUnused) continue;
    number[v] = used;
    mesh.vertices[used] = mesh.vertices[v];
    if (!mesh.colors.empty()) mesh.colors[used] = mesh.colors[v];
    ++used;
  }
  mesh.vertices.resize(used);
  if (!mesh.colors.empty()) mesh.colors.resize(used);
  for (Face& face : mesh.faces)
    for (std::uint32_t& v : face) v = number[v];
}

// The points with their colours, or else with the mean colour of the cells whose faces they are.
TriangleMesh colored(const VtkSurface& surface, std::vector<Face> faces,
                     const std::vector<std::size_t>& cell_of_face) {
  TriangleMesh mesh{surface.points, std::move(faces), {}};
  const VtkColors &points = surface.point_colors, &cells = surface.cell_colors;
  if (!points.written.empty()) {
    mesh.colors = linear_colors(points.written, points.scale);
  } else if (!cells.written.empty()) {
    std::vector<Eigen::Vector3d> written;
    for (const std::size_t cell : cell_of_face) written.push_back(cells.written.at(cell));
    mesh.colors = vertex_from_face_colors(mesh.faces, linear_colors(written, cells.scale),
                                          mesh.vertices.size());
  }
  return mesh;
}

}  // namespace

VtkCells::VtkCells(const std::vector<double>& ends, const std::vector<double>& corners,
                   std::size_t points, const std::string& name) {
  if (points > std::numeric_limits<std::uint32_t>::max())
    throw BadDataError(name + ": " + std::to_string(points) +
                       " points are more than a mesh can index");
  double begin = 0;
  for (std::size_t cell = 0; cell < ends.size(); begin = ends[cell++]) {
    if (!(ends[cell] >= begin && ends[cell] <= static_cast<double>(corners.size())))
      throw BadDataError(name + ": cell " + std::to_string(cell) +
                         " ends outside the list of its points");
    for (auto at = static_cast<std::size_t>(begin); at < static_cast<std::size_t>(ends[cell]);
         ++at) {
      if (!(corners[at] >= 0 && corners[at] < static_cast<double>(points)))
        throw BadDataError(name + ": cell " + std::to_string(cell) + " uses point " +
                           std::to_string(static_cast<long double>(corners[at])) + " of " +
                           std::to_string(points));
      corners_.push_back(static_cast<std::uint32_t>(corners[at]));
    }
    ends_.push_back(corners_.size());
  }
}

TriangleMesh triangles_of(const VtkSurface& surface, const VtkCells& polygons,
                          const VtkCells& strips, std::size_t cells_before,
                          const std::string& name) {
  std::vector<Face> faces;
  std::vector<std::size_t> cell_of_face;
  for (std::size_t cell = 0; cell < polygons.size(); ++cell) {
    cut_polygon(surface.points, polygons[cell], faces);
    cell_of_face.resize(faces.size(), cells_before + cell);
  }
  for (std::size_t cell = 0; cell < strips.size(); ++cell) {
    if (strips[cell].size() < 3)
      throw BadDataError(name + ": triangle strip " + std::to_string(cell) + " has " +
                         std::to_string(strips[cell].size()) + " points; a triangle takes three");
    cut_strip(strips[cell], faces);
    cell_of_face.resize(faces.size(), cells_before + polygons.size() + cell);
  }
  return colored(surface, std::move(faces), cell_of_face);
}

TriangleMesh outside_of(const VtkSurface& surface, const VtkCells& cells,
                        const std::vector<double>& kinds, const std::string& name) {
  std::vector<CellFace> all;
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const auto nodes = cells[cell];
    const CellKind& kind = checked_kind(cell, kinds[cell], nodes.size(), name);
    if (kinds[cell] == kPolygon || kinds[cell] == kStrip)
      all.push_back(face_of(nodes, cell, 0, false));
    for (std::size_t face = 0; face < kind.faces.size(); ++face) {
      std::vector<std::uint32_t> corners;
      for (const std::uint8_t corner : kind.faces[face]) corners.push_back(nodes[corner]);
      all.push_back(face_of(corners, cell, face, kind.solid));
    }
  }
  const std::vector<bool> shown = outer(all);
  std::vector<Face> faces;
  std::vector<std::size_t> cell_of_face;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!shown[i]) continue;
    const auto nodes = cells[all[i].cell];
    const auto number = static_cast<int>(kinds[all[i].cell]);
    const std::size_t before = faces.size();
    if (number == kPolygon)
      cut_polygon(surface.points, nodes, faces);
    else if (number == kStrip)
      cut_strip(nodes, faces);
    else
      FaceCutter(cell_kinds().at(number), nodes, all[i].face).append(surface.points, faces);
    if (all[i].solid) turn_from_middle(surface.points, nodes, std::span(faces).subspan(before));
    cell_of_face.resize(faces.size(), all[i].cell);
  }
  TriangleMesh mesh = colored(surface, std::move(faces), cell_of_face);
  drop_unused_points(mesh);
  return mesh;
}

}  // namespace organbake
