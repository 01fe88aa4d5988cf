// SPDX-License-Identifier: Apache-2.0
// Pictures whose colours stand for a number on the skin, such as displacement or strain: the
// numbers are rasterised over the posed surface and shown in viridis (Smith, van der Walt & Firing
// 2015), by the light and dark of the frame.
#include "organbake/player/false_colors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/warp/rasteriser.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Two edges of a face in coordinates of its plane.
Eigen::Matrix2d edges_of(const Face& face, const std::vector<Vector3d>& at_mm) {
  const Vector3d u = at_mm[face[1]] - at_mm[face[0]], v = at_mm[face[2]] - at_mm[face[0]];
  const Vector3d x = u.stableNormalized();
  const Vector3d y = v - x * x.dot(v);
  Eigen::Matrix2d edges;
  edges << u.norm(), x.dot(v), 0, y.norm();
  return edges;
}

// Of the deformation gradient in the plane: the root of the eigenvalues of FᵀF.
double farther_stretch(const Eigen::Matrix2d& gradient) {
  const Eigen::Matrix2d c = gradient.transpose() * gradient;
  const double middle = 0.5 * c.trace();
  const double apart = std::hypot(0.5 * (c(0, 0) - c(1, 1)), c(0, 1));
  const double most = std::sqrt(middle + apart), least = std::sqrt(std::max(0.0, middle - apart));
  return most - 1 > 1 - least ? most : least;
}

struct Values {
  std::vector<float> depth, value;
};

void rasterise_values(const MeasuredSurface& surface, const View& view, Values& seen) {
  const PixelBox picture{0, 0, view.camera.intrinsics.width, view.camera.intrinsics.height};
  draw_depths(project_faces(surface.posed.faces, surface.posed.vertices, view), picture, seen.depth,
              [&](std::size_t i, std::uint32_t f, const std::array<double, 3>& w) {
                const auto& [a, b, c] = surface.posed.faces[f];
                seen.value[i] = static_cast<float>(
                    w[0] * surface.values[a] + w[1] * surface.values[b] + w[2] * surface.values[c]);
              });
}

}  // namespace

std::vector<double> displacement_mm(const std::vector<Vector3d>& rest_mm,
                                    const std::vector<Vector3d>& posed_mm) {
  std::vector<double> moved(rest_mm.size());
  for (std::size_t v = 0; v < moved.size(); ++v) moved[v] = (posed_mm[v] - rest_mm[v]).norm();
  return moved;
}

std::vector<double> surface_strain(const std::vector<Face>& faces,
                                   const std::vector<Vector3d>& rest_mm,
                                   const std::vector<Vector3d>& posed_mm) {
  std::vector<double> strain(rest_mm.size()), area(rest_mm.size());
  for (const Face& face : faces) {
    const Eigen::Matrix2d rest = edges_of(face, rest_mm);
    const double doubled_area = rest.determinant();
    if (!(doubled_area > 1e-9)) continue;  // mm²: no plane to be stretched in
    const double stretch = farther_stretch(edges_of(face, posed_mm) * rest.inverse());
    for (const std::uint32_t vertex : face) {
      strain[vertex] += doubled_area * (stretch - 1);
      area[vertex] += doubled_area;
    }
  }
  for (std::size_t v = 0; v < strain.size(); ++v)
    if (area[v] > 0) strain[v] /= area[v];
  return strain;
}

std::array<std::uint8_t, 3> false_color(double share) {
  constexpr std::array<std::array<std::uint8_t, 3>, 9> kViridis = {{{0x44, 0x01, 0x54},
                                                                    {0x47, 0x2d, 0x7b},
                                                                    {0x3b, 0x52, 0x8b},
                                                                    {0x2c, 0x72, 0x8e},
                                                                    {0x21, 0x91, 0x8c},
                                                                    {0x28, 0xae, 0x80},
                                                                    {0x5e, 0xc9, 0x62},
                                                                    {0xad, 0xdc, 0x30},
                                                                    {0xfd, 0xe7, 0x25}}};
  const double at = (kViridis.size() - 1) * std::clamp(share, 0.0, 1.0);
  const std::size_t from = std::min(kViridis.size() - 2, static_cast<std::size_t>(at));
  std::array<std::uint8_t, 3> color;
  for (int c = 0; c < 3; ++c)
    color[c] = static_cast<std::uint8_t>(std::lround(
        std::lerp(double(kViridis[from][c]), double(kViridis[from + 1][c]), at - double(from))));
  return color;
}

Rgb8Image false_color_picture(const Frame& frame, const View& view,
                              const std::vector<MeasuredSurface>& surfaces, double least,
                              double most) {
  Rgb8Image picture = frame.color;
  const std::size_t pixels = frame.cover.size();
  Values seen{std::vector<float>(pixels, std::numeric_limits<float>::infinity()),
              std::vector<float>(pixels)};
  for (const MeasuredSurface& surface : surfaces) rasterise_values(surface, view, seen);
  constexpr double kOwnLight = 0.35, kMiddleGrey = 110;  // of the skin's own brightness
  for (std::size_t i = 0; i < pixels; ++i) {
    if (frame.cover[i] == Cover::background || frame.cover[i] == Cover::solid ||
        !std::isfinite(seen.depth[i]))
      continue;
    std::uint8_t* pixel = &picture.pixels[3 * i];
    const double grey = 0.3 * pixel[0] + 0.59 * pixel[1] + 0.11 * pixel[2];
    const double light = 1 - kOwnLight + kOwnLight * grey / kMiddleGrey;
    const auto color = false_color((seen.value[i] - least) / (most - least));
    for (int c = 0; c < 3; ++c)
      pixel[c] = static_cast<std::uint8_t>(std::clamp(light * color[c], 0.0, 255.0));
  }
  return picture;
}

}  // namespace organbake
