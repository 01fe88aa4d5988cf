// SPDX-License-Identifier: GPL-3.0-or-later
// Connected pieces of a contour, by union of vertices, and which of them are kept. All in place: a
// contour may be as large as memory allows. A closed piece is its outer wall with the walls of the
// cavities that lie in it. And what makes surfaces smooth: a separable Gaussian on the values
// before they are contoured, an axis after the other. Rows that lie side by side are worked on
// together, so that memory is read in its order for every axis.
#include "surface_steps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/parallel.h"
#include "organbake/core/union_find.h"

namespace organbake {
namespace {

// Of its piece's volume: a smaller cavity is a gap that whoever drew the label left, and is filled.
constexpr double kGap = 0.01;

struct Component {
  double area = 0;         // twice, mm²
  double volume = 0;       // six times, mm³
  std::uint32_t root = 0;  // its smallest vertex
  Eigen::AlignedBox3d box = {};
  double cavity_volume = 0;                  // of its cavities, below 0
  std::vector<std::uint32_t> cavities = {};  // their roots

  double solid() const { return volume + cavity_volume; }
};

// For every vertex the smallest vertex of its component.
std::vector<std::uint32_t> label_vertices(const TriangleMesh& mesh) {
  UnionFind joined(mesh.vertices.size());
  for (const Face& face : mesh.faces)
    for (int c = 1; c < 3; ++c) joined.join(face[0], face[c]);
  return std::move(joined).roots();
}

std::vector<Component> measure(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root) {
  constexpr std::uint32_t kNone = ~0u;
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
  std::vector<Component> components;
  for (const Face& face : mesh.faces) {
    std::uint32_t& n = number[root[face[0]]];
    if (n == kNone) {
      n = static_cast<std::uint32_t>(components.size());
      components.push_back({.root = root[face[0]]});
    }
    const Eigen::Vector3d& a = mesh.vertices[face[0]];
    // Seen from the component's own vertex: far from the world's origin digits would cancel.
    const Eigen::Vector3d& origin = mesh.vertices[root[face[0]]];
    const Eigen::Vector3d cross = (mesh.vertices[face[1]] - a).cross(mesh.vertices[face[2]] - a);
    components[n].area += cross.norm();
    components[n].volume += (a - origin).dot(cross);
    for (const std::uint32_t corner : face) components[n].box.extend(mesh.vertices[corner]);
  }
  return components;
}

// In place, since a mesh may be as large as memory allows: what is kept moves towards the front.
void drop_others(TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
                 const std::vector<bool>& kept_root) {
  std::vector<std::uint32_t> renumbered(mesh.vertices.size(), 0);
  std::uint32_t vertices = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!kept_root[root[v]]) continue;
    mesh.vertices[vertices] = mesh.vertices[v];
    renumbered[v] = vertices++;
  }
  std::size_t faces = 0;
  for (const Face& face : mesh.faces) {
    if (!kept_root[root[face[0]]]) continue;
    mesh.faces[faces++] = {renumbered[face[0]], renumbered[face[1]], renumbered[face[2]]};
  }
  mesh.vertices.resize(vertices);
  mesh.faces.resize(faces);
}

double longest_side(const Component& component) { return component.box.sizes().maxCoeff(); }

// How often the faces of a component wind about a point (van Oosterom, Strackee 1983).
double winding(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
               std::uint32_t component, const Eigen::Vector3d& point) {
  double half_angles = 0;
  for (const Face& face : mesh.faces) {
    if (root[face[0]] != component) continue;
    const Eigen::Vector3d a = mesh.vertices[face[0]] - point, b = mesh.vertices[face[1]] - point,
                          c = mesh.vertices[face[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    half_angles +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles / (2 * std::numbers::pi);
}

// The innermost piece round a cavity. Boxes alone tell it mostly; a ring, say, has other pieces in
// its box.
Component& piece_round(const TriangleMesh& mesh, const std::vector<std::uint32_t>& root,
                       std::vector<Component>& pieces, const Component& cavity) {
  std::vector<Component*> round;
  for (Component& piece : pieces)
    if (piece.box.contains(cavity.box)) round.push_back(&piece);
  if (round.size() > 1) {
    std::erase_if(round, [&](const Component* piece) {
      return winding(mesh, root, piece->root, mesh.vertices[cavity.root]) < 0.5;
    });
  }
  const auto less = [](const Component* a, const Component* b) { return a->volume < b->volume; };
  return round.empty() ? pieces.front() : **std::min_element(round.begin(), round.end(), less);
}

// Pieces of negative volume are the walls of cavities: with the piece round them they stay, or they
// go. Where there is nothing but such, it is a solid inside out.
std::vector<Component> with_cavities(const TriangleMesh& mesh,
                                     const std::vector<std::uint32_t>& root,
                                     std::vector<Component> pieces, const ComponentFilter& filter) {
  const auto first_cavity = std::stable_partition(pieces.begin(), pieces.end(),
                                                  [](const Component& c) { return c.volume > 0; });
  if (filter.cavities == Cavities::none || first_cavity == pieces.begin()) return pieces;
  const std::vector<Component> cavities(first_cavity, pieces.end());
  pieces.erase(first_cavity, pieces.end());
  if (filter.cavities == Cavities::filled && filter.largest > 0) return pieces;
  for (const Component& cavity : cavities) {
    if (longest_side(cavity) < filter.min_size_mm) continue;
    Component& piece = piece_round(mesh, root, pieces, cavity);
    if (filter.largest > 0 && -cavity.volume < kGap * piece.volume) continue;
    piece.cavities.push_back(cavity.root);
    piece.cavity_volume += cavity.volume;
  }
  return pieces;
}

void keep_chosen(const ComponentFilter& filter, std::vector<Component>& pieces) {
  std::erase_if(pieces, [&](const Component& c) { return longest_side(c) < filter.min_size_mm; });
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Component& a, const Component& b) { return a.area > b.area; });
  if (filter.largest > 0) pieces.resize(std::min(filter.largest, pieces.size()));
}

// The solid that pieces are, or the area of open ones.
double amount(const std::vector<Component>& pieces, bool open) {
  double volume = 0, area = 0;
  for (const Component& piece : pieces) {
    volume += std::max(0.0, piece.solid());
    area += piece.area;
  }
  return open ? area : volume;
}

}  // namespace

KeptComponents keep_components(TriangleMesh mesh, const ComponentFilter& filter) {
  const std::vector<std::uint32_t> root = label_vertices(mesh);
  const bool open = filter.cavities == Cavities::none;
  std::vector<Component> pieces = with_cavities(mesh, root, measure(mesh, root), filter);
  const std::size_t found = pieces.size();
  const double before = amount(pieces, open);
  keep_chosen(filter, pieces);
  std::vector<bool> kept_root(mesh.vertices.size(), false);
  for (const Component& piece : pieces) {
    kept_root[piece.root] = true;
    for (const std::uint32_t cavity : piece.cavities) kept_root[cavity] = true;
  }
  drop_others(mesh, root, kept_root);
  const double left_out = before > 0 ? 1 - amount(pieces, open) / before : 0;
  return {std::move(mesh), found, pieces.size(), std::max(0.0, left_out)};
}

namespace {

// Half of a symmetric kernel, from the centre outwards; each weight is the Gaussian's share of the
// voxel, so that a σ below one voxel still blurs by σ.
std::vector<float> half_kernel(double sigma) {
  const int reach = gaussian_reach(sigma);
  std::vector<double> weights;
  double sum = 0;
  const double scale = 1 / (std::sqrt(2.0) * sigma);
  for (int i = 0; i <= reach; ++i) {
    weights.push_back(0.5 * (std::erf((i + 0.5) * scale) - std::erf((i - 0.5) * scale)));
    sum += i == 0 ? weights.back() : 2 * weights.back();
  }
  std::vector<float> kernel;
  for (const double w : weights) kernel.push_back(static_cast<float>(w / sum));
  return kernel;
}

// Blurs `count` rows of `width` values that lie `stride` apart, across the rows. The inner loop
// runs over neighbouring values, so it vectorises for every axis but x.
void blur_across(const float* in, float* out, int count, std::size_t stride, int width,
                 const std::vector<float>& kernel) {
  const int reach = static_cast<int>(kernel.size()) - 1;
  for (int row = 0; row < count; ++row) {
    float* to = out + row * stride;
    const float* centre = in + row * stride;
    for (int x = 0; x < width; ++x) to[x] = kernel[0] * centre[x];
    for (int r = 1; r <= reach; ++r) {
      const float* before = in + std::max(row - r, 0) * stride;
      const float* after = in + std::min(row + r, count - 1) * stride;
      for (int x = 0; x < width; ++x) to[x] += kernel[r] * (before[x] + after[x]);
    }
  }
}

void blur_row(const float* in, float* out, int width, const std::vector<float>& kernel,
              std::vector<float>& padded) {
  const int reach = static_cast<int>(kernel.size()) - 1;
  padded.resize(static_cast<std::size_t>(width + 2 * reach));
  std::fill_n(padded.begin(), reach, in[0]);
  std::copy_n(in, width, padded.begin() + reach);
  std::fill_n(padded.begin() + reach + width, reach, in[width - 1]);
  const float* centre = padded.data() + reach;
  for (int x = 0; x < width; ++x) out[x] = kernel[0] * centre[x];
  for (int r = 1; r <= reach; ++r)
    for (int x = 0; x < width; ++x) out[x] += kernel[r] * (centre[x - r] + centre[x + r]);
}

}  // namespace

int gaussian_reach(double sigma_voxels) {
  return sigma_voxels > 0 ? static_cast<int>(std::ceil(3 * sigma_voxels)) : 0;
}

void gaussian_blur(std::vector<float>& values, const std::array<int, 3>& size,
                   const Eigen::Vector3d& sigma_voxels) {
  const auto [nx, ny, nz] = size;
  const std::size_t slice = static_cast<std::size_t>(nx) * ny;
  std::vector<float> other(values.size());
  for (int axis = 0; axis < 3; ++axis) {
    if (!(sigma_voxels[axis] > 0)) continue;
    const std::vector<float> kernel = half_kernel(sigma_voxels[axis]);
    if (axis == 2) {
      parallel_for(0, ny, [&](int j) {
        const std::size_t row = std::size_t(j) * nx;
        blur_across(&values[row], &other[row], nz, slice, nx, kernel);
      });
    } else {
      parallel_for(0, nz, [&](int k) {
        if (axis == 1) {
          blur_across(&values[k * slice], &other[k * slice], ny, std::size_t(nx), nx, kernel);
          return;
        }
        std::vector<float> padded;
        for (std::size_t row = k * slice; row < (k + 1) * slice; row += std::size_t(nx))
          blur_row(&values[row], &other[row], nx, kernel, padded);
      });
    }
    values.swap(other);
  }
}

}  // namespace organbake
