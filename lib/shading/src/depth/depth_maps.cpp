// SPDX-License-Identifier: GPL-3.0-or-later
// Depth maps of frames: rays of a camera's pixels, depth and normals of ln r, and a mesh of a map,
// torn where the surface is seen edge-on. In: planes of numbers and a camera. Out: planes, or
// triangles with the frame's colours.
#include "organbake/shading/depth_maps.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/grid_filters.h"

namespace organbake {
Eigen::Vector3d normal_at(const Plane& log_range, const RayGrid& rays, int column, int row) {
  const double x = rays.x(column), y = rays.y(row), s2 = 1 + x * x + y * y;
  const double p =
      derivative_at(&log_range.values[log_range.index(0, row)], column, log_range.width, 1) /
      rays.step_x;
  const double q =
      derivative_at(&log_range.values[column], row, log_range.height, log_range.width) /
      rays.step_y;
  // ln z = v − ½ ln(1+x²+y²); the surface z(x, y)·(x, y, 1) has the normal (a, b, −1 − xa − yb)
  // with a, b the slopes of ln z.
  const double a = p - x / s2, b = q - y / s2;
  return Eigen::Vector3d(a, b, -1 - x * a - y * b).normalized();
}

Plane depth_from_log_range(const Plane& log_range, const RayGrid& rays, const Mask& inside) {
  Plane depth(log_range.width, log_range.height, std::numeric_limits<float>::infinity());
  for (int row = 0; row < depth.height; ++row)
    for (int column = 0; column < depth.width; ++column) {
      if (!inside.at(column, row)) continue;
      const double x = rays.x(column), y = rays.y(row);
      depth.at(column, row) = static_cast<float>(std::exp(double(log_range.at(column, row))) /
                                                 std::sqrt(1 + x * x + y * y));
    }
  return depth;
}

std::vector<Eigen::Vector3f> normals_from_log_range(const Plane& log_range, const RayGrid& rays) {
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(log_range.size());
  for (int row = 0; row < log_range.height; ++row)
    for (int column = 0; column < log_range.width; ++column)
      normals.push_back(normal_at(log_range, rays, column, row).cast<float>());
  return normals;
}

std::vector<Eigen::Vector3f> smooth_normals_from_depth(const Plane& depth, const RayGrid& rays,
                                                       int radius) {
  Plane log_range(depth.width, depth.height);
  Mask known(depth.width, depth.height);
  for (int y = 0; y < depth.height; ++y)
    for (int x = 0; x < depth.width; ++x) {
      const float z = depth.at(x, y);
      if (!(std::isfinite(z) && z > 0)) continue;
      known.at(x, y) = 1;
      log_range.at(x, y) = std::log(z * static_cast<float>(std::hypot(1.0, rays.x(x), rays.y(y))));
    }
  fill_outside(log_range, known);
  const Mask everywhere(depth.width, depth.height, 1);
  for (int pass = 0; pass < 2; ++pass) log_range = box_mean(log_range, everywhere, radius);
  return normals_from_log_range(log_range, rays);
}

// Two triangles a grid cell where the depth map has depth. Along its border they are cut where a
// smoothed mask of the depth crosses a level (marching triangles; Hilton et al. 1996): masks of
// pixels end in stairs that a surface would show as teeth.
namespace {

// Inside the edge of the depth by a third of the smoothing: stairs and notches lie outside it.
constexpr float kBorderLevel = 0.7F;
constexpr int kSmoothingShare = 100;  // of the width

bool has_depth(float z) { return std::isfinite(z) && z > 0; }

// Means along rows over windows that shrink towards the frame's edges, so that they stay even to
// both sides: what a border does beyond is not known, and a window that ends there would bend it
// outward.
Plane mean_along_rows(const Plane& plane, int radius) {
  Plane mean(plane.width, plane.height);
  std::vector<double> before(static_cast<std::size_t>(plane.width) + 1, 0);
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) before[x + 1] = before[x] + double(plane.at(x, y));
    for (int x = 0; x < plane.width; ++x) {
      const int reach = std::min({radius, x, plane.width - 1 - x});
      mean.at(x, y) =
          static_cast<float>((before[x + reach + 1] - before[x - reach]) / (2 * reach + 1));
    }
  }
  return mean;
}

Plane transposed(const Plane& plane) {
  Plane other(plane.height, plane.width);
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x) other.at(y, x) = plane.at(x, y);
  return other;
}

// 1 well inside the depth, falling to 0 across its border; below the level where there is none.
Plane smooth_cover(const Plane& depth) {
  Plane cover(depth.width, depth.height);
  for (std::size_t k = 0; k < cover.size(); ++k) cover.values[k] = has_depth(depth.values[k]);
  const int radius = std::max(1, cover.width / kSmoothingShare);
  for (int pass = 0; pass < 4; ++pass) cover = transposed(mean_along_rows(cover, radius));
  for (std::size_t k = 0; k < cover.size(); ++k)
    if (!has_depth(depth.values[k]))
      cover.values[k] = std::min(cover.values[k], 0.9F * kBorderLevel);
  return cover;
}

class SheetMesher {
 public:
  SheetMesher(const Plane& depth, const Rgb8Image& color, const Intrinsics& camera,
              const DepthMeshOptions& options)
      : depth_(depth),
        color_(color),
        camera_(camera),
        options_(options),
        cover_(smooth_cover(depth)),
        columns_((camera.width - 1) / options.step_px + 1),
        rows_((camera.height - 1) / options.step_px + 1),
        vertex_(columns_, rows_, kNoVertex) {}

  TriangleMesh mesh() {
    for (int j = 0; j < rows_; ++j)
      for (int i = 0; i < columns_; ++i)
        if (at({i, j}).inside) vertex_.at(i, j) = add(at({i, j}));
    // Seen from the camera (x right, y down, z away) these corners turn so that the normal points
    // back.
    for (int j = 0; j + 1 < rows_; ++j)
      for (int i = 0; i + 1 < columns_; ++i) {
        cut({{{i, j}, {i, j + 1}, {i + 1, j}}});
        cut({{{i + 1, j}, {i, j + 1}, {i + 1, j + 1}}});
      }
    return std::move(mesh_);
  }

 private:
  static constexpr std::uint32_t kNoVertex = ~std::uint32_t{0};
  struct Node {
    int i, j;
  };
  // A place of the surface, in pixels of the frame.
  struct Place {
    Eigen::Vector2d pixel;
    float z, cover;
    bool inside;
    Eigen::Vector3f color;
  };

  Place at(const Node& node) const {
    const int x = node.i * options_.step_px, y = node.j * options_.step_px;
    const float z = depth_.at(x, y), cover = cover_.at(x, y);
    return {{x + 0.5, y + 0.5}, z, cover, has_depth(z) && cover >= kBorderLevel, color_at(x, y)};
  }

  // Mean over the step's pixels that have depth.
  Eigen::Vector3f color_at(int x, int y) const {
    const auto& linear = linear_from_srgb8();
    const int reach = (options_.step_px - 1) / 2;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float count = 0;
    for (int v = std::max(0, y - reach); v <= std::min(depth_.height - 1, y + reach); ++v)
      for (int u = std::max(0, x - reach); u <= std::min(depth_.width - 1, x + reach); ++u) {
        if (!has_depth(depth_.at(u, v))) continue;
        const std::uint8_t* p = color_.at(u, v);
        sum += Eigen::Vector3f(linear[p[0]], linear[p[1]], linear[p[2]]);
        ++count;
      }
    return sum / std::max(1.F, count);
  }

  std::uint32_t add(const Place& place) {
    mesh_.vertices.push_back(double(place.z) * unproject(camera_, place.pixel));
    mesh_.colors.push_back(place.color);
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  bool torn(double low, double high) const {
    return high - low > options_.tear * options_.step_px * low;
  }

  // Where the border crosses the way from a node inside to one outside. Depth is not continued
  // over a jump, nor where there is none.
  std::uint32_t crossing(const Node& in, const Node& out) {
    const auto number = [&](const Node& n) {
      return static_cast<std::uint64_t>(n.j) * columns_ + n.i;
    };
    const auto [found, is_new] =
        crossings_.try_emplace(number(in) * columns_ * rows_ + number(out), kNoVertex);
    if (!is_new) return found->second;
    Place place = at(in);
    const Place beyond = at(out);
    const float t = (place.cover - kBorderLevel) / std::max(1e-6F, place.cover - beyond.cover);
    place.pixel += double(t) * (beyond.pixel - place.pixel);
    if (has_depth(beyond.z) && !torn(std::min(place.z, beyond.z), std::max(place.z, beyond.z)))
      place.z += t * (beyond.z - place.z);
    return found->second = add(place);
  }

  // The part of a triangle that lies inside.
  void cut(const std::array<Node, 3>& corners) {
    std::array<std::uint32_t, 4> polygon{};
    std::size_t size = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Node &here = corners[k], &next = corners[(k + 1) % 3];
      const bool in = vertex_.at(here.i, here.j) != kNoVertex;
      const bool next_in = vertex_.at(next.i, next.j) != kNoVertex;
      if (in) polygon[size++] = vertex_.at(here.i, here.j);
      if (in != next_in) polygon[size++] = in ? crossing(here, next) : crossing(next, here);
    }
    for (std::size_t k = 2; k < size; ++k) join({polygon[0], polygon[k - 1], polygon[k]});
  }

  void join(const std::array<std::uint32_t, 3>& face) {
    const double z[3] = {mesh_.vertices[face[0]].z(), mesh_.vertices[face[1]].z(),
                         mesh_.vertices[face[2]].z()};
    const auto [low, high] = std::minmax_element(z, z + 3);
    if (!torn(*low, *high)) mesh_.faces.push_back({face[0], face[1], face[2]});
  }

  const Plane& depth_;
  const Rgb8Image& color_;
  const Intrinsics& camera_;
  const DepthMeshOptions& options_;
  Plane cover_;
  int columns_, rows_;
  Grid<std::uint32_t> vertex_;
  std::unordered_map<std::uint64_t, std::uint32_t> crossings_;
  TriangleMesh mesh_;
};

}  // namespace

void DepthMeshOptions::check() const {
  if (!(step_px >= 1 && step_px <= 64))
    throw UsageError("mesh_step is " + std::to_string(step_px) + "; it must be in 1…64");
  if (!(tear > 0 && tear <= 1))
    throw UsageError("tear is " + to_text(tear) + "; it must be in 0…1");
}

TriangleMesh mesh_from_depth(const Plane& depth_mm, const Rgb8Image& color,
                             const Intrinsics& camera, const DepthMeshOptions& options) {
  options.check();
  if (depth_mm.width != camera.width || depth_mm.height != camera.height ||
      color.width != camera.width || color.height != camera.height)
    throw BadDataError("depth, colour and camera are of different sizes");
  const TriangleMesh mesh = SheetMesher(depth_mm, color, camera, options).mesh();
  if (mesh.faces.empty())
    throw BadDataError("no part of the depth map can be meshed; is the frame masked altogether?");
  return largest_components(mesh, options.largest_only ? 1 : 0);
}

}  // namespace organbake
