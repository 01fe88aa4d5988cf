// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_mesh.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNoVertex = ~std::uint32_t{0};

Eigen::Vector3f linear_color(const Rgb8Image& color, int x, int y) {
  const auto& linear = linear_from_srgb8();
  const std::uint8_t* p = color.at(x, y);
  return {linear[p[0]], linear[p[1]], linear[p[2]]};
}

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
  const int step = options.step_px;
  const int columns = (camera.width - 1) / step + 1, rows = (camera.height - 1) / step + 1;
  TriangleMesh mesh;
  Grid<std::uint32_t> vertex(columns, rows, kNoVertex);
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const float depth = depth_mm.at(i * step, j * step);
      if (!std::isfinite(depth) || depth <= 0) continue;
      vertex.at(i, j) = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(double(depth) * unproject(camera, {i * step + 0.5, j * step + 0.5}));
      mesh.colors.push_back(linear_color(color, i * step, j * step));
    }
  const auto joined = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a == kNoVertex || b == kNoVertex || c == kNoVertex) return;
    const double z[3] = {mesh.vertices[a].z(), mesh.vertices[b].z(), mesh.vertices[c].z()};
    const auto [low, high] = std::minmax_element(z, z + 3);
    if (*high - *low > options.tear * step * *low) return;
    mesh.faces.push_back({a, b, c});
  };
  // Seen from the camera (x right, y down, z away) these corners turn so that the normal points
  // back.
  for (int j = 0; j + 1 < rows; ++j)
    for (int i = 0; i + 1 < columns; ++i) {
      const std::uint32_t a = vertex.at(i, j), b = vertex.at(i + 1, j);
      const std::uint32_t c = vertex.at(i, j + 1), d = vertex.at(i + 1, j + 1);
      joined(a, c, b);
      joined(b, c, d);
    }
  if (mesh.faces.empty())
    throw BadDataError("no part of the depth map can be meshed; is the frame masked altogether?");
  return largest_components(mesh, options.largest_only ? 1 : 0);
}

}  // namespace organbake
