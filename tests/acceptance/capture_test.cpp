// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/version.h>
#if CGAL_VERSION_NR >= 1060000000
#include <CGAL/AABB_traits_3.h>
#include <CGAL/AABB_triangle_primitive_3.h>
#else
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_triangle_primitive.h>
#endif

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "measuring/agreement.h"
#include "measuring/scenes.h"
#include "organbake/capture/capture.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/parallel.h"
#include "organbake/core/random.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"
#include "promises.h"

namespace organbake {
namespace {

// Where a ray first meets a mesh, by CGAL's AABB tree: predicates exact, the point in double.
class ExactDepth {
 public:
  explicit ExactDepth(const TriangleMesh& mesh);
  ~ExactDepth();

  // In units of |direction|; +inf when the ray meets nothing.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
#if CGAL_VERSION_NR >= 1060000000  // which names the dimension
using Primitive = CGAL::AABB_triangle_primitive_3<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits_3<Kernel, Primitive>>;
#else
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
#endif
Kernel::Point_3 point_of(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

struct ExactDepth::Impl {
  Triangles triangles;
  std::unique_ptr<Tree> tree;
};

ExactDepth::ExactDepth(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  for (const auto& [a, b, c] : mesh.faces) {
    impl_->triangles.emplace_back(point_of(mesh.vertices[a]), point_of(mesh.vertices[b]),
                                  point_of(mesh.vertices[c]));
  }
  impl_->tree = std::make_unique<Tree>(impl_->triangles.begin(), impl_->triangles.end());
}

ExactDepth::~ExactDepth() = default;

double ExactDepth::first_hit(const Eigen::Vector3d& origin,
                             const Eigen::Vector3d& direction) const {
  const Kernel::Ray_3 ray(point_of(origin),
                          Kernel::Vector_3(direction.x(), direction.y(), direction.z()));
  const auto first = impl_->tree->first_intersected_primitive(ray);
  if (!first) return std::numeric_limits<double>::infinity();
  const Kernel::Triangle_3& triangle = **first;
  // The plane's own equation, in double: t = n · (a − o) / n · d.
  const Kernel::Vector_3 normal =
      CGAL::cross_product(triangle[1] - triangle[0], triangle[2] - triangle[0]);
  return normal * (triangle[0] - ray.source()) / (normal * ray.to_vector());
}

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kBarColor = {0.01f, 0.02f, 0.9f};  // no tissue is blue

// The organ, perhaps behind a bar, in flat light: a photograph of it shows the albedo itself.
class FlatScene {
 public:
  FlatScene(const TriangleMesh& surface, std::size_t organ_faces, const OrganPhantom& phantom)
      : surface_(surface), organ_faces_(organ_faces), phantom_(phantom) {}

  const TracedSurface& surface() const { return surface_; }
  bool is_organ(const RayHit& hit) const { return hit.face < organ_faces_; }
  Vector3f albedo(const RayHit& hit, const Vector3d& point) const {
    return is_organ(hit) ? phantom_.albedo(point) : kBarColor;
  }

  // 3 × 3 rays a pixel, black behind the organ.
  Photo photograph(const PosedCamera& camera) const {
    const CameraRays camera_rays(camera);
    Photo photo{camera, Rgb8Image(camera.intrinsics.width, camera.intrinsics.height)};
    parallel_for(0, photo.image.height, [&](int y) {
      std::vector<Ray> rays;
      for (int x = 0; x < photo.image.width; ++x) {
        for (int k = 0; k < kRays; ++k) rays.push_back(ray_in(camera_rays, x, y, k));
      }
      std::vector<RayHit> hits(rays.size());
      surface_.rays.first_hits(rays, hits);
      for (int x = 0; x < photo.image.width; ++x) {
        Vector3f sum = Vector3f::Zero();
        for (std::size_t r = std::size_t(x) * kRays; r < std::size_t(x + 1) * kRays; ++r) {
          if (hits[r].face == kNoHit) continue;
          sum += albedo(hits[r], rays[r].origin + hits[r].t * rays[r].direction);
        }
        for (int c = 0; c < 3; ++c) photo.image.at(x, y)[c] = srgb8_from_linear(sum[c] / kRays);
      }
    });
    return photo;
  }

  // The mean over a texel, of what lies at its centre's depth within a few texels.
  Vector3f true_color(const PosedCamera& camera, int x, int y, double depth_mm) const {
    const CameraRays camera_rays(camera);
    std::vector<Ray> rays;
    for (int k = 0; k < kRays; ++k) rays.push_back(ray_in(camera_rays, x, y, k));
    std::vector<RayHit> hits(rays.size());
    surface_.rays.first_hits(rays, hits);
    Vector3f sum = Vector3f::Zero();
    int count = 0;
    const double same_mm = 6 * depth_mm / camera_rays.focal_px();
    for (int k = 0; k < kRays; ++k) {
      if (hits[k].face == kNoHit || std::abs(hits[k].t - depth_mm) > same_mm) continue;
      sum += albedo(hits[k], rays[k].origin + hits[k].t * rays[k].direction);
      ++count;
    }
    return sum / static_cast<float>(std::max(1, count));
  }

 private:
  static constexpr int kSide = 3, kRays = kSide * kSide;
  static Ray ray_in(const CameraRays& camera, int x, int y, int k) {
    return camera.through(x + (k % kSide + 0.5) / kSide, y + (k / kSide + 0.5) / kSide);
  }

  TracedSurface surface_;
  std::size_t organ_faces_;
  const OrganPhantom& phantom_;
};

// A stored texel, what it should show, and who sees it.
struct ColorProbe {
  Vector3f baked, truth;
  bool in_sight = false;  // of a photo's camera: in its frame, facing it, nothing between
  bool used = false;      // a photo's colour counts
};

// From this sum of weights on, the photos decide a colour (make_colors.cpp).
constexpr float kSeenWeight = 0.02f;

class Sights {
 public:
  Sights(const TracedSurface& surface, const std::vector<Photo>& photos) : surface_(surface) {
    for (const Photo& photo : photos) {
      cameras_.push_back(photo.camera);
      views_.emplace_back(photo, surface);
    }
  }

  bool used(const RayHit& hit, const Vector3d& point) const {
    float weight = 0;
    for (const PhotoView& view : views_)
      weight += view.look_at_point(point, surface_.normals.at(hit)).weight;
    return weight >= kSeenWeight;
  }
  bool in_sight(const RayHit& hit, const Vector3d& point) const {
    return std::any_of(cameras_.begin(), cameras_.end(), [&](const PosedCamera& camera) {
      const Vector3d eye = camera.center_world_mm(), in_camera = camera.camera_from_world * point;
      if (in_camera.z() <= 0 || !surface_.normals.faces_against(hit.face, point - eye))
        return false;
      const Eigen::Vector2d pixel = project(camera.intrinsics, in_camera);
      if (pixel.minCoeff() < 0 || pixel.x() > camera.intrinsics.width ||
          pixel.y() > camera.intrinsics.height)
        return false;
      // Short of the point by more than the margin that occluded() keeps.
      const Ray ray{eye, point - eye, 0, 1 - 1e-4};
      std::uint8_t hidden = 0;
      surface_.rays.occluded({&ray, 1}, {&hidden, 1});
      return hidden == 0;
    });
  }

 private:
  const TracedSurface& surface_;
  std::vector<PosedCamera> cameras_;
  std::vector<PhotoView> views_;
};

// Random stored texels of the organ in all maps.
std::vector<ColorProbe> probes_of(const CaptureResult& captured, const CaptureScenario& scene,
                                  const FlatScene& flat, const Sights& sights) {
  constexpr int kProbes = 60'000;
  constexpr std::uint64_t kSeed = 7;
  std::vector<ColorProbe> probes(kProbes);
  parallel_for(0, kProbes, [&](int i) {
    RandomStream random(kSeed, static_cast<std::uint64_t>(i));
    while (true) {
      const std::size_t c = random.below(scene.cameras.size());
      const CameraMaps& maps = captured.maps[c];
      const std::size_t texel = random.below(maps.face.size());
      if (maps.face[texel] == kNoFace) continue;
      const int x = static_cast<int>(texel % maps.width), y = static_cast<int>(texel / maps.width);
      const Ray ray = CameraRays(scene.cameras[c]).through(x + 0.5, y + 0.5);
      RayHit hit;
      flat.surface().rays.first_hits({&ray, 1}, {&hit, 1});
      if (hit.face == kNoHit || !flat.is_organ(hit)) continue;
      const Vector3d point = ray.origin + hit.t * ray.direction;
      probes[i] = {maps.color[texel], flat.true_color(scene.cameras[c], x, y, hit.t),
                   sights.in_sight(hit, point), sights.used(hit, point)};
      return;
    }
  });
  return probes;
}

// Of 8-bit sRGB values over the probes that photos colour.
double rms_levels(const std::vector<ColorProbe>& probes) {
  double sum = 0;
  std::size_t count = 0;
  for (const ColorProbe& probe : probes) {
    if (!probe.used) continue;
    for (int c = 0; c < 3; ++c, ++count) {
      const double error =
          double(srgb8_from_linear(probe.baked[c])) - srgb8_from_linear(probe.truth[c]);
      sum += error * error;
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, count)));
}

std::vector<Photo> photographs(const FlatScene& flat, const std::vector<PosedCamera>& cameras) {
  std::vector<Photo> photos;
  for (const PosedCamera& camera : cameras) photos.push_back(flat.photograph(camera));
  return photos;
}

OrganPhantom six_photographs() {
  OrganPhantomOptions options;
  options.photo_count = 6;
  options.photo_size = 1024;
  return OrganPhantom(options);
}

TEST(CaptureColor, OfPhotographsIsTheAlbedo) {
  const OrganPhantom phantom = six_photographs();
  const CaptureScenario scene = capture_scenario(8, 512);
  const FlatScene flat(scene.surface, scene.surface.faces.size(), phantom);
  const std::vector<Photo> photos = photographs(flat, phantom.photo_cameras());
  const auto color = make_photo_color(flat.surface(), photos);
  const Sights sights(flat.surface(), photos);
  for (const int side : {1, 2, 3, 4}) {
    CaptureOptions options;
    options.rays_per_texel_side = side;
    const CaptureResult captured =
        capture(scene.surface, scene.proxy, scene.cameras, *color, options);
    const std::vector<ColorProbe> probes = probes_of(captured, scene, flat, sights);
    const double rms = rms_levels(probes);
    report(std::to_string(side * side) + " rays a texel: colour error, RMS", "levels", rms);
    constexpr int kStandard = 2;
    if (side != kStandard) continue;
    const auto in_sight = std::count_if(probes.begin(), probes.end(),
                                        [](const ColorProbe& probe) { return probe.in_sight; });
    const auto used = std::count_if(probes.begin(), probes.end(), [](const ColorProbe& probe) {
      return probe.in_sight && probe.used;
    });
    expect({"colour of photo-seen texels against the albedo", "dB", 20 * std::log10(255 / rms), 35,
            Figure::Goal::at_least});
    expect({"texels in a photo's sight that photos colour", "%",
            100.0 * static_cast<double>(used) / static_cast<double>(in_sight), 90,
            Figure::Goal::at_least});
  }
}

// A bar of 8 × 80 × 4 mm that floats 25 mm before the organ, between it and the first photo.
TriangleMesh bar_before(const TriangleMesh& organ, const PosedCamera& camera) {
  const Vector3d center = bounds(organ).center();
  const Eigen::Matrix3d axes = camera.camera_from_world.rotation.transpose();
  const Vector3d front = -axes.col(2);
  double reach = 0;
  for (const Vector3d& vertex : organ.vertices)
    reach = std::max(reach, (vertex - center).dot(front));
  const Vector3d half = {4, 40, 2}, middle = center + (reach + 25) * front;
  TriangleMesh bar;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    bar.vertices.push_back(middle + axes * sign.cwiseProduct(half));
  }
  bar.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
               {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return bar;
}

TEST(CaptureColor, OfAnOccluderBleedsOnNothing) {
  const OrganPhantom phantom = six_photographs();
  CaptureScenario scene = capture_scenario(8, 512);
  const std::size_t organ_faces = scene.surface.faces.size();
  const auto base = static_cast<std::uint32_t>(scene.surface.vertices.size());
  const std::vector<PosedCamera> cameras = phantom.photo_cameras();
  const TriangleMesh bar = bar_before(scene.surface, cameras.front());
  scene.surface.vertices.insert(scene.surface.vertices.end(), bar.vertices.begin(),
                                bar.vertices.end());
  for (const auto& [a, b, c] : bar.faces)
    scene.surface.faces.push_back({base + a, base + b, base + c});
  scene.surface.colors.clear();
  const FlatScene flat(scene.surface, organ_faces, phantom);
  const std::vector<Photo> photos = photographs(flat, cameras);
  const auto color = make_photo_color(flat.surface(), photos);
  const Sights sights(flat.surface(), photos);
  const CaptureResult captured = capture(scene.surface, scene.proxy, scene.cameras, *color, {});
  // The bar is far bluer than tissue: a tenth of it shows as this much.
  const float bled = 0.1f * kBarColor[2];
  const std::vector<ColorProbe> probes = probes_of(captured, scene, flat, sights);
  const auto count = std::count_if(probes.begin(), probes.end(), [&](const ColorProbe& probe) {
    return probe.baked[2] - probe.truth[2] > bled;
  });
  expect({"texels with a tenth of an occluder's colour, of " + std::to_string(probes.size()), "",
          static_cast<double>(count), 0});
}

// Whether a texel's ray, which meets the surface, does so at no grazing angle: those aren't kept.
bool kept_for_sure(const RayScene& scene, const SmoothNormals& normals, const Ray& ray) {
  constexpr double kLeastCosine = 0.2;
  RayHit hit;
  scene.first_hits({&ray, 1}, {&hit, 1});
  return hit.face == kNoHit || -normals.at(hit).dot(ray.direction.normalized()) > kLeastCosine;
}

TEST(CaptureDepth, IsThatOfAnExactOracle) {
  const CaptureScenario scene = capture_scenario(8, 1024);
  const CaptureResult captured =
      capture(scene.surface, scene.proxy, scene.cameras, *make_vertex_color(scene.surface), {});
  constexpr int kTexels = 10'000;
  constexpr std::uint64_t kSeed = 6;
  const ExactDepth oracle(scene.surface);
  const RayScene rays(scene.surface);
  const SmoothNormals normals(scene.surface);
  RandomStream random(kSeed);
  double worst = 0;
  int met = 0, met_by_one = 0;
  while (met < kTexels) {
    const std::size_t c = random.below(scene.cameras.size());
    const CameraMaps& maps = captured.maps[c];
    const std::size_t texel = random.below(maps.face.size());
    const Ray ray = texel_ray(scene.cameras[c], texel);
    const double exact = oracle.first_hit(ray.origin, ray.direction);
    const bool ours = std::isfinite(maps.depth_mm[texel]);
    if (ours != std::isfinite(exact) && (ours || kept_for_sure(rays, normals, ray))) ++met_by_one;
    if (!ours || !std::isfinite(exact)) continue;
    worst = std::max(worst, std::abs(maps.depth_mm[texel] - exact) / exact);
    ++met;
  }
  expect({"depth at 10,000 texels' centres against CGAL, worst", "of the depth", worst, 1e-5});
  expect(
      {"texels that only one of both says are hit, grazing ones aside", "", double(met_by_one), 0});
}

}  // namespace

}  // namespace organbake
