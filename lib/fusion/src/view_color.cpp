// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/fusion/fuse_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "organbake/core/median.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

struct WeightedColor {
  Vector3f color;
  float weight;
};

std::optional<Vector3f> color_at(const Rgb8Image& image, const Eigen::Vector2d& pixel) {
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 0 && v >= 0 && u < image.width - 1 && v < image.height - 1)) return std::nullopt;
  const auto& linear = linear_from_srgb8();
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const auto a = static_cast<float>(u - x), b = static_cast<float>(v - y);
  const float shares[4] = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
  Vector3f color = Vector3f::Zero();
  for (int i = 0; i < 4; ++i) {
    const std::uint8_t* p = image.at(x + i % 2, y + i / 2);
    color += shares[i] * Vector3f(linear[p[0]], linear[p[1]], linear[p[2]]);
  }
  return color;
}

// A lamp at the lens, against one at `usual_mm` that falls straight on the surface.
double light_of(PictureLight light, double cosine, double range_mm, double usual_mm) {
  constexpr double kLeastCosine = 0.2;
  if (light == PictureLight::any) return 1;
  return std::max(kLeastCosine, cosine) * usual_mm * usual_mm / (range_mm * range_mm);
}

class VertexColors {
 public:
  VertexColors(const std::vector<DepthView>& views, const std::vector<SmoothView>& smooth,
               PictureLight light, double surface_mm)
      : views_(views), smooth_(smooth), light_(light), surface_mm_(surface_mm) {
    std::vector<float> depths;
    for (const SmoothView& view : smooth)
      for (std::size_t k = 0; k < view.depth_mm.size(); k += 97)
        if (view.weight.values[k] > 0) depths.push_back(view.depth_mm.values[k]);
    usual_mm_ = median(std::move(depths));
  }

  std::optional<Vector3f> color(const Vector3d& point, const Vector3d& normal) const {
    std::vector<WeightedColor> seen;
    for (std::size_t i = 0; i < views_.size(); ++i)
      if (const auto one = seen_by(i, point, normal)) seen.push_back(*one);
    if (seen.empty()) return std::nullopt;
    return without_strangers(seen);
  }

 private:
  std::optional<WeightedColor> seen_by(std::size_t i, const Vector3d& world,
                                       const Vector3d& normal) const {
    if (views_[i].color.width == 0) return std::nullopt;
    const RigidTransform& camera_from_world = smooth_[i].camera.camera_from_world;
    const Vector3d point = camera_from_world * world;
    const double cosine = -(camera_from_world.rotation * normal).dot(point) / point.norm();
    constexpr double kLeastCosine = 0.15;
    if (!(point.z() > 0 && cosine > kLeastCosine)) return std::nullopt;
    const SeenSurface surface = seen_at(smooth_[i], world);
    if (!(surface.weight > 0) || std::abs(surface.depth_mm - surface.point_z_mm) > surface_mm_)
      return std::nullopt;
    const auto color = color_at(views_[i].color,
                                project(views_[i].color_lens, views_[i].color_from_camera * point));
    if (!color) return std::nullopt;
    const double light = light_of(light_, cosine, point.norm(), usual_mm_);
    const double weight = surface.weight * cosine * cosine / point.squaredNorm();
    return WeightedColor{*color / static_cast<float>(light), static_cast<float>(weight)};
  }

  // The mean about the median of the brightnesses.
  static Vector3f without_strangers(const std::vector<WeightedColor>& seen) {
    std::vector<float> sums;
    for (const WeightedColor& one : seen) sums.push_back(one.color.sum());
    std::nth_element(sums.begin(), sums.begin() + (sums.size() - 1) / 2, sums.end());
    const float usual = sums[(sums.size() - 1) / 2];
    constexpr float kAlike = 0.1F, kDark = 0.02F;
    Vector3f color = Vector3f::Zero();
    float weight = 0;
    for (const WeightedColor& one : seen) {
      const float off = (one.color.sum() - usual) / (kAlike * (usual + kDark));
      const float counts = one.weight / (1 + off * off);
      color += counts * one.color;
      weight += counts;
    }
    return color / weight;
  }

  const std::vector<DepthView>& views_;
  const std::vector<SmoothView>& smooth_;
  PictureLight light_;
  double surface_mm_, usual_mm_ = 1;
};

// Vertex by vertex from its neighbours, as often as it takes.
void spread_colors(TriangleMesh& mesh, std::vector<std::uint8_t> colored) {
  constexpr int kMostRounds = 200;
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<Vector3f> sums(mesh.vertices.size(), Vector3f::Zero());
    std::vector<int> counts(mesh.vertices.size(), 0);
    bool any = false;
    for (const Face& face : mesh.faces)
      for (const std::uint32_t to : face)
        for (const std::uint32_t from : face) {
          if (colored[to] || !colored[from]) continue;
          sums[to] += mesh.colors[from];
          ++counts[to];
          any = true;
        }
    if (!any) return;
    for (std::size_t v = 0; v < counts.size(); ++v) {
      if (counts[v] == 0) continue;
      mesh.colors[v] = sums[v] / static_cast<float>(counts[v]);
      colored[v] = 1;
    }
  }
}

}  // namespace

double color_by_views(const std::vector<DepthView>& views, const std::vector<SmoothView>& smooth,
                      PictureLight light, double surface_mm, TriangleMesh& mesh) {
  mesh.colors.clear();
  const bool any = std::any_of(views.begin(), views.end(),
                               [](const DepthView& view) { return view.color.width > 0; });
  if (!any || mesh.vertices.empty()) return 0;
  const VertexColors colors(views, smooth, light, surface_mm);
  const std::vector<Vector3d> normals = vertex_normals(mesh);
  mesh.colors.assign(mesh.vertices.size(), Vector3f::Zero());
  std::vector<std::uint8_t> colored(mesh.vertices.size(), 0);
  parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
    const auto color = colors.color(mesh.vertices[v], normals[v]);
    if (!color) return;
    mesh.colors[v] = color->cwiseMin(1.F).cwiseMax(0.F);
    colored[v] = 1;
  });
  const auto seen = std::count(colored.begin(), colored.end(), 1);
  const double share = static_cast<double>(seen) / static_cast<double>(colored.size());
  spread_colors(mesh, std::move(colored));
  return share;
}

}  // namespace organbake
