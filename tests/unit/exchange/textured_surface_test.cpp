// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/exchange.h"

#include "charts.h"
#include "organ_to_export.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/raycast/ray_scene.h"
#include "support/error_message.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array<std::uint8_t, 3> kGround = {22, 23, 26};  // organplay's own

TriangleMesh plain(const TexturedMesh& textured) {
  TriangleMesh mesh{textured.vertices, {}, {}};
  for (const auto& [a, b, c] : textured.faces) mesh.faces.push_back({a.vertex, b.vertex, c.vertex});
  return mesh;
}

// As any GPU draws it without light: bilinear, 4 × 4 samples a pixel.
class TextureViewer {
 public:
  explicit TextureViewer(const TexturedMesh& mesh) : mesh_(mesh), scene_(plain(mesh)) {}

  // Of an image at a hit, 0…255.
  Vector3d texel(const Rgb8Image& image, const RayHit& hit) const {
    const auto& corners = mesh_.faces[hit.face];
    const Vector2d uv = (1 - hit.u - hit.v) * mesh_.coordinates[corners[0].coordinate] +
                        double(hit.u) * mesh_.coordinates[corners[1].coordinate] +
                        double(hit.v) * mesh_.coordinates[corners[2].coordinate];
    const double x = uv.x() * image.width - 0.5, y = (1 - uv.y()) * image.height - 0.5;
    const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const int i = std::clamp(left + k % 2, 0, image.width - 1);
      const int j = std::clamp(top + k / 2, 0, image.height - 1);
      const double w = (k % 2 ? x - left : 1 - x + left) * (k / 2 ? y - top : 1 - y + top);
      for (int c = 0; c < 3; ++c) sum[c] += w * image.at(i, j)[c];
    }
    return sum;
  }

  RayHit hit(const PosedCamera& camera, const Vector2d& pixel) const {
    const Ray ray{camera.center_world_mm(), camera.camera_from_world.rotation.transpose() *
                                                unproject(camera.intrinsics, pixel)};
    RayHit found;
    scene_.first_hits({&ray, 1}, {&found, 1});
    return found;
  }

  Rgb8Image draw(const PosedCamera& camera) const {
    constexpr int kSide = 4;
    Rgb8Image picture(camera.intrinsics.width, camera.intrinsics.height);
    parallel_for(0, picture.height, [&](int y) {
      for (int x = 0; x < picture.width; ++x) {
        Vector3d sum = Vector3d::Zero();
        for (int r = 0; r < kSide * kSide; ++r) {
          const RayHit found =
              hit(camera, {x + (r % kSide + 0.5) / kSide, y + (r / kSide + 0.5) / kSide});
          for (int c = 0; c < 3; ++c)
            sum[c] += found.face == kNoHit ? kGround[c] : texel(mesh_.color, found)[c];
        }
        for (int c = 0; c < 3; ++c)
          picture.at(x, y)[c] = static_cast<std::uint8_t>(std::lround(sum[c] / (kSide * kSide)));
      }
    });
    return picture;
  }

 private:
  const TexturedMesh& mesh_;
  RayScene scene_;
};

const TexturedMesh& exported() {
  static const TexturedMesh mesh = textured_surface(organ_to_export(), {});
  return mesh;
}

TEST(TexturedSurface, KeepsShapeAndFaces) {
  const TriangleMesh mesh = plain(exported());
  EXPECT_LE(mesh.faces.size(), 10000u);
  EXPECT_GT(mesh.faces.size(), 9900u);
  EXPECT_TRUE(analyse_topology(mesh).closed_manifold());
  EXPECT_GT(signed_volume(mesh), 0);
  double worst_mm = 0;
  for (const Vector3d& vertex : mesh.vertices)
    worst_mm = std::max(worst_mm, off_surface_mm(vertex));
  EXPECT_LT(worst_mm, 0.2) << "faces of 2.5 mm on an organ of 50 mm";
  EXPECT_EQ(exported().color.width, 2048);
  EXPECT_EQ(exported().normal_map.height, 2048);
}

// The target: 32 dB against what the player shows, at 10,000 faces.
TEST(TexturedSurface, LooksAsThePlayerShowsIt) {
  const TextureViewer viewer(exported());
  Player player(organ_to_export());
  constexpr double kTarget_db = 32;
  for (const OrbitPose& pose : {OrbitPose{}, OrbitPose{0.7, 0.4}, OrbitPose{2.4, -0.5}}) {
    const View view = orbit_view(organ_to_export().cameras, pose, 320, 240);
    Frame frame;
    player.draw(view, {}, frame);
    const double psnr_db = compare_images(viewer.draw(view.camera), frame.color).psnr_db;
    RecordProperty("psnr_db", std::to_string(psnr_db));
    EXPECT_GT(psnr_db, kTarget_db) << pose.azimuth_rad;
  }
}

// Seams included: what a filter finds anywhere is the organ's own colour there.
TEST(TexturedSurface, ShowsTheOrgansColoursEverywhere) {
  const TextureViewer viewer(exported());
  const PosedCamera& camera = organ_to_export().cameras.cameras[3];
  double squares = 0, worst = 0;
  int count = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector2d pixel(256 * std::fmod(0.618034 * i, 1), 256 * (i + 0.5) / 20000);
    const RayHit hit = viewer.hit(camera, pixel);
    if (hit.face == kNoHit) continue;
    const Vector3d ray =
        camera.camera_from_world.rotation.transpose() * unproject(camera.intrinsics, pixel);
    const Vector3d place = camera.center_world_mm() + hit.t * ray;
    const Eigen::Vector3f truth = export_options().organ.color(place);
    const Vector3d shown = viewer.texel(exported().color, hit);
    for (int c = 0; c < 3; ++c) {
      const double off = shown[c] - srgb8_from_linear(truth[c]);
      squares += off * off;
      worst = std::max(worst, std::abs(off));
    }
    count += 3;
  }
  ASSERT_GT(count, 15000);
  EXPECT_LT(std::sqrt(squares / count), 4) << "of 255 levels";
  EXPECT_LT(worst, 48) << "black or another chart's colour would be farther off";
}

TEST(TexturedSurface, ItsNormalMapHoldsTheOrgansNormals) {
  const TexturedMesh& mesh = exported();
  const TextureViewer viewer(mesh);
  const PosedCamera& camera = organ_to_export().cameras.cameras[1];
  const SyntheticOrgan& organ = export_options().organ;
  const auto normal_at = [&](const Vector3d& place) {
    // Of the level set |p − c| = radius(direction), by differences.
    const auto level = [&](const Vector3d& p) {
      const Vector3d d = p - organ.center;
      return d.norm() - organ.radius(d.normalized());
    };
    Vector3d gradient;
    constexpr double kStep_mm = 1e-3;
    for (int k = 0; k < 3; ++k)
      gradient[k] =
          level(place + kStep_mm * Vector3d::Unit(k)) - level(place - kStep_mm * Vector3d::Unit(k));
    return Vector3d(gradient.normalized());
  };
  double mapped = 0, flat = 0;
  int count = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vector2d pixel(256 * std::fmod(0.618034 * i, 1), 256 * (i + 0.5) / 4000);
    const RayHit hit = viewer.hit(camera, pixel);
    if (hit.face == kNoHit) continue;
    const auto& corners = mesh.faces[hit.face];
    const double w[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
    Vector3d place = Vector3d::Zero(), n = place, t = place;
    for (int k = 0; k < 3; ++k) {
      place += w[k] * mesh.vertices[corners[k].vertex];
      n += w[k] * mesh.normals[corners[k].vertex];
      t += w[k] * mesh.tangents[corners[k].coordinate];
    }
    n.normalize(), t.normalize();
    const Vector3d m = viewer.texel(mesh.normal_map, hit) / 127.5 - Vector3d::Ones();
    const Vector3d shown = (m.x() * t + m.y() * n.cross(t) + m.z() * n).normalized();
    const Vector3d truth = normal_at(place);
    mapped += 1 - shown.dot(truth);
    flat += 1 - face_normal(plain(mesh), hit.face).dot(truth);
    ++count;
    if (count == 400) break;  // each looks at a whole copy of the mesh
  }
  ASSERT_EQ(count, 400);
  EXPECT_LT(std::acos(1 - mapped / count), 0.03) << "radians: 2 levels of 255 and the maps' steps";
  EXPECT_LT(mapped, flat) << "closer than the faces' own";
}

TEST(TexturedSurface, TangentsLieAcrossNormals) {
  const TexturedMesh& mesh = exported();
  for (const auto& face : mesh.faces)
    for (const TexturedMesh::Corner& corner : face) {
      ASSERT_NEAR(mesh.tangents[corner.coordinate].norm(), 1, 1e-6);
      ASSERT_NEAR(mesh.tangents[corner.coordinate].dot(mesh.normals[corner.vertex]), 0, 1e-6);
      ASSERT_GE(mesh.coordinates[corner.coordinate].minCoeff(), 0);
      ASSERT_LE(mesh.coordinates[corner.coordinate].maxCoeff(), 1);
    }
}

TEST(TexturedSurface, IsTheSameForAnyNumberOfThreads) {
  const TexturedSurfaceOptions small{.faces = 500, .texture_side = 256};
  const TexturedMesh many = textured_surface(organ_to_export(), small);
  ThreadLimit one(1);
  const TexturedMesh alone = textured_surface(organ_to_export(), small);
  EXPECT_EQ(many.color.pixels, alone.color.pixels);
  EXPECT_EQ(many.normal_map.pixels, alone.normal_map.pixels);
  EXPECT_EQ(many.vertices, alone.vertices);
}

TEST(TexturedSurface, TakesItsTexelsFromTheMapsWhenAsked) {
  const TexturedMesh mesh = textured_surface(organ_to_export(), {.texture_side = 0});
  // 256² maps that show the organ 200 texels across, for all of its sides: some of 200² times π.
  EXPECT_GE(mesh.color.width, 512);
  EXPECT_LE(mesh.color.width, 1024);
}

TEST(TexturedSurface, AlbedoIsColourOverLight) {
  Bundle lit = organ_to_export();
  lit.lighting.emplace();
  lit.lighting->ambient_above = lit.lighting->ambient_below = Vector3d::Constant(2);
  lit.lighting->gloss = {{0.2, 30}};
  const TexturedSurfaceOptions small{.faces = 500, .texture_side = 256};
  TexturedSurfaceOptions albedo = small;
  albedo.albedo = true;
  const TexturedMesh baked = textured_surface(lit, small), freed = textured_surface(lit, albedo);
  for (std::size_t i = 0; i < baked.color.pixels.size(); i += 997) {
    const float light = linear_from_srgb(baked.color.pixels[i] / 255.0f);
    EXPECT_NEAR(freed.color.pixels[i], srgb8_from_linear(light / 2), 2);
  }
  EXPECT_NEAR(baked.roughness, std::pow(2.0 / 32, 0.25), 1e-9);
  EXPECT_THAT(message_of(ExitCode::usage, [&] { textured_surface(organ_to_export(), albedo); }),
              testing::HasSubstr("lighting.json"));
}

TEST(TexturedSurface, OptionsAreChecked) {
  EXPECT_NO_THROW(TexturedSurfaceOptions().check());
  EXPECT_THROW(TexturedSurfaceOptions{.faces = 3}.check(), UsageError);
  EXPECT_THROW(TexturedSurfaceOptions{.texture_side = 9000}.check(), UsageError);
}

double flat_area(const TriangleMesh& mesh, const Chart& chart, std::uint32_t face) {
  const Face& f = mesh.faces[face];
  const Eigen::Vector2d a = chart.flat(mesh.vertices[f[0]]), b = chart.flat(mesh.vertices[f[1]]),
                        c = chart.flat(mesh.vertices[f[2]]);
  return 0.5 * ((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x());
}

// A ramp that winds round an axis and lies over itself: each face looks along the axis.
TriangleMesh spiral_ramp() {
  TriangleMesh mesh;
  constexpr int kSteps = 60;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 4 * M_PI * i / kSteps;
    for (const double r : {20.0, 30.0})
      mesh.vertices.emplace_back(r * std::cos(angle), r * std::sin(angle), 0.5 * i);
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    mesh.faces.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    mesh.faces.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  return mesh;
}

TEST(Charts, HoldEveryFaceOnceWithoutShrinkingIt) {
  for (const TriangleMesh& mesh : {lumpy_mesh(40, 4), box_mesh({10, 20, 30}), spiral_ramp()}) {
    std::vector<int> held(mesh.faces.size(), 0);
    for (const Chart& chart : cut_into_charts(mesh)) {
      EXPECT_NEAR(chart.u.cross(chart.v).dot(chart.axis), 1, 1e-12);
      for (const std::uint32_t face : chart.faces) {
        ++held[face];
        EXPECT_GT(flat_area(mesh, chart, face), 0.64 * face_area(mesh, face));
      }
    }
    EXPECT_EQ(std::count(held.begin(), held.end(), 1), std::ptrdiff_t(held.size()));
  }
}

TEST(Charts, DoNotLieOverThemselves) {
  const TriangleMesh ramp = spiral_ramp();
  const std::vector<Chart> charts = cut_into_charts(ramp);
  EXPECT_GE(charts.size(), 2u);
  for (const Chart& chart : charts) {
    // No middle of a face lies inside another.
    for (const std::uint32_t f : chart.faces) {
      Eigen::Vector2d middle = Eigen::Vector2d::Zero();
      for (const std::uint32_t v : ramp.faces[f]) middle += chart.flat(ramp.vertices[v]) / 3;
      for (const std::uint32_t g : chart.faces) {
        if (f == g) continue;
        int left = 0;
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector2d a = chart.flat(ramp.vertices[ramp.faces[g][k]]),
                                b = chart.flat(ramp.vertices[ramp.faces[g][(k + 1) % 3]]);
          left += (b - a).x() * (middle - a).y() - (b - a).y() * (middle - a).x() > 0;
        }
        EXPECT_LT(left, 3) << f << " lies in " << g;
      }
    }
  }
}

}  // namespace
}  // namespace organbake
