// SPDX-License-Identifier: GPL-3.0-or-later
// The fusion from depth maps to one coloured surface: how the views overlap, and colours, each
// vertex by all pictures that see it, the straighter and nearer the more, a highlight less.
#include "organbake/fusion/fuse_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

constexpr int kAcross = 40;  // points of a view, in each direction
// A surface behind or in front of another by more is another one.
constexpr double kSameSurface = 0.5;
// Poses and noise move a surface by less.
constexpr double kAgreeing = 0.06;

}  // namespace

std::vector<ViewOverlap> measure_overlap(const std::vector<SmoothView>& views) {
  std::vector<ViewOverlap> overlaps;
  for (const SmoothView& view : views) {
    const int step = std::max(1, std::max(view.depth_mm.width, view.depth_mm.height) / kAcross);
    double points = 0, shared = 0, agreeing = 0;
    std::vector<double> logs;
    for (int y = step / 2; y < view.depth_mm.height; y += step)
      for (int x = step / 2; x < view.depth_mm.width; x += step) {
        if (!(view.weight.at(x, y) > 0)) continue;
        ++points;
        const Eigen::Vector3d point = view.point_world_mm(x, y);
        const Eigen::Vector3d normal = view.normal_world(x, y);
        bool seen_too = false, agrees = false;
        for (const SmoothView& other : views) {
          if (&other == &view) continue;
          const SeenSurface seen = seen_at(other, point);
          if (!(seen.weight > 0) || !is_same_side(other, seen, normal)) continue;
          const double ratio = std::log(seen.point_z_mm / seen.depth_mm);
          if (std::abs(ratio) > kSameSurface) continue;
          seen_too = true;
          agrees = agrees || std::abs(ratio) < kAgreeing;
          logs.push_back(ratio);
        }
        shared += seen_too;
        agreeing += agrees;
      }
    const double usual = logs.empty() ? 0 : median(logs);
    for (double& ratio : logs) ratio = std::abs(ratio - usual);
    overlaps.push_back({points > 0 ? shared / points : 0, std::exp(usual),
                        shared > 0 ? agreeing / shared : 1, median(std::move(logs))});
  }
  return overlaps;
}

bool sees_nothing_in_common(const ViewOverlap& overlap) {
  constexpr double kLeastShare = 0.02;
  return overlap.share < kLeastShare;
}

bool is_of_another_scale(const ViewOverlap& overlap) {
  // What hides behind something is farther away, too; but then not everything is, nor by as much.
  constexpr double kFewAgree = 0.15, kMostScale = 1.15, kMostSpread = 0.35;
  const double apart = std::abs(std::log(overlap.scale));
  return overlap.agreeing < kFewAgree && apart > std::log(kMostScale) &&
         overlap.spread < kMostSpread * apart;
}

namespace {

// Throws BadDataError for a view that sees nothing that another one sees, or is of another scale.
void check_overlap(const std::vector<ViewOverlap>& overlaps, const std::vector<DepthView>& views) {
  if (views.size() < 2) return;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewOverlap& overlap = overlaps[i];
    if (sees_nothing_in_common(overlap))
      throw BadDataError(views[i].name,
                         "sees nothing that another depth map sees: is its pose right, and its "
                         "depth in millimetres?");
    if (is_of_another_scale(overlap))
      throw BadDataError(views[i].name, "lies " + to_text(overlap.scale, 2) +
                                            " times as far away as the other depth maps have the "
                                            "same surface: it is of another scale (--scale each "
                                            "finds one for each map)");
  }
}

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
      : views_(views),
        smooth_(smooth),
        light_(light),
        surface_mm_(surface_mm),
        usual_mm_(usual_depth_mm(smooth)) {}

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

// Colours each vertex by all pictures that see it, the straighter and nearer the more; one that
// differs from the others (a highlight) counts less. What none sees takes its neighbours' colour.
// smooth[i] belongs to views[i]. Without any picture the mesh has no colours. Returns the share of
// vertices that a picture sees.
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

}  // namespace

void FusionOptions::check() const {
  require(voxel_mm == 0 || (voxel_mm >= 0.02 && voxel_mm <= 50), "voxel", voxel_mm,
          "it must be in 0.02…50 mm, or 0 for the depth maps' own");
}

FusedSurface fuse_views(const std::vector<DepthView>& views, const FusionOptions& options,
                        const RunContext& context) {
  options.check();
  if (views.empty()) throw BadDataError("there is no depth map to fuse");
  ScaledViews scaled = scaled_views(views, options.scale);
  std::vector<SmoothView>& smooth = scaled.views;
  check_overlap(measure_overlap(smooth), views);
  context.progress(0.2);
  FusedSurface fused;
  fused.scale = scaled.scale;
  if (options.refine) fused.refined = refine_poses(smooth);
  fused.apart_mm = fused.refined ? fused.refined->after_mm : views_apart_mm(smooth);
  context.throw_if_cancelled();
  context.progress(0.4);

  // Wide enough for what averaging leaves of the noise; wider would reach the organ's other side.
  constexpr double kVoxels = 4;
  const VoxelBox box = box_round(smooth, options.voxel_mm);
  fused.voxel_mm = box.voxel_mm;
  fused.truncation_mm = kVoxels * box.voxel_mm;
  const DistanceVolume volume = fuse_distances(smooth, box, fused.truncation_mm, context);
  context.progress(0.8);
  TriangleMesh surface = surface_of(volume, options.holes);
  if (options.least_support > 0 && options.holes == Holes::open)
    surface = trimmed_surface(largest_components(surface, options.largest), volume,
                              options.least_support);
  fused.mesh = largest_components(surface, options.largest);
  if (fused.mesh.faces.empty())
    throw BadDataError(
        "no surface is left: the depth maps do not overlap, or their poses are far off");
  if (options.color_mm > 0) fused.mesh = finer_surface(fused.mesh, options.color_mm);
  fused.colored_share =
      color_by_views(views, smooth, options.light, 2 * fused.truncation_mm, fused.mesh);
  for (const SmoothView& view : smooth) fused.cameras.push_back(view.camera);
  return fused;
}

}  // namespace organbake
