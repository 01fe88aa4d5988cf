// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/raycast/ray_scene.h"
#include "organbake/raycast/face_queries.h"

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Hits are computed in double from the face: a few roundings of distances of 100 mm.
constexpr double kHitRounding = 1e-11;
// A ray this near to an edge (in corner weights) may be decided by float rounding alone.
constexpr double kFloatEdge = 1e-5;

RayHit trace(const RayScene& scene, const Ray& ray) {
  RayHit hit;
  scene.first_hits({&ray, 1}, {&hit, 1});
  return hit;
}

std::vector<RayHit> trace(const RayScene& scene, const std::vector<Ray>& rays) {
  std::vector<RayHit> hits(rays.size());
  scene.first_hits(rays, hits);
  return hits;
}

bool is_occluded(const RayScene& scene, const Ray& ray) {
  std::uint8_t flag = 0;
  scene.occluded({&ray, 1}, {&flag, 1});
  return flag != 0;
}

Eigen::Vector3d random_direction(RandomStream& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

bool equal(const RayHit& a, const RayHit& b) {
  return a.face == b.face && a.t == b.t && a.u == b.u && a.v == b.v;
}

TEST(RayScene, CameraRaysGivePlanarDepth) {
  const RayScene scene(grid_box({40, 40, 10}, 1));
  for (const double x : {-0.1, 0.0, 0.07}) {
    const RayHit hit = trace(scene, {{0, 0, -105}, {x, 0.03, 1}});
    ASSERT_NE(hit.face, kNoHit);
    EXPECT_NEAR(hit.t, 100, kHitRounding);
  }
  EXPECT_EQ(trace(scene, {{0, 0, -105}, {0.3, 0, 1}}).face, kNoHit);
  EXPECT_EQ(trace(scene, {{0, 0, -105}, {0, 0, -1}}).t, kInfinity);
}

TEST(RayScene, EqualsBruteForceInDouble) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const RayScene scene(mesh);
  RandomStream random(3);
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    Ray ray{60 * random_direction(random), random_direction(random)};
    RayHit truth;
    double nearest_edge = 1;
    for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
      const Face& face = mesh.faces[f];
      const PlaneCrossing at =
          cross_plane({mesh.vertices[face[0]], mesh.vertices[face[1]], mesh.vertices[face[2]]},
                      ray.origin, ray.direction);
      const double weight = std::min({at.u, at.v, 1 - at.u - at.v});
      nearest_edge = std::min(nearest_edge, std::abs(weight));
      if (weight > 0 && at.t > 0 && at.t < truth.t) truth = {f, at.t, 0, 0};
    }
    if (nearest_edge < kFloatEdge) continue;
    ++compared;
    const RayHit hit = trace(scene, ray);
    ASSERT_EQ(hit.face, truth.face);
    if (truth.face != kNoHit) {
      ASSERT_NEAR(hit.t, truth.t, kHitRounding);
    }
    ASSERT_EQ(is_occluded(scene, ray), truth.face != kNoHit);
  }
  EXPECT_GT(compared, 1800);
}

TEST(RayScene, HitsReproduceTheirPoint) {
  const TriangleMesh mesh = lumpy_mesh(50, 3);
  const RayScene scene(mesh);
  RandomStream random(4);
  for (int i = 0; i < 1000; ++i) {
    const Ray ray{{0, 0, 0}, 3 * random_direction(random)};
    const RayHit hit = trace(scene, ray);
    ASSERT_NE(hit.face, kNoHit);
    const Face& f = mesh.faces[hit.face];
    const Eigen::Vector3d point = (1.0 - hit.u - hit.v) * mesh.vertices[f[0]] +
                                  double(hit.u) * mesh.vertices[f[1]] +
                                  double(hit.v) * mesh.vertices[f[2]];
    // u and v are floats: 6e-8 of edges of 15 mm.
    EXPECT_LT((ray.origin + hit.t * ray.direction - point).norm(), 5e-6);
  }
}

// From inside a closed mesh every ray hits, most of all those aimed at edges and vertices.
TEST(RayScene, NoRaySlipsThroughAnEdge) {
  const TriangleMesh mesh = lumpy_mesh(50, 4);
  for (const Eigen::Vector3d& offset : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1e6, 3e5, 7e6)}) {
    const RayScene scene(moved(mesh, offset));
    const Eigen::Vector3d origin(1, 2, 3);
    std::vector<Ray> rays;
    for (const Face& f : mesh.faces) {
      for (int c = 0; c < 3; ++c) {
        const Eigen::Vector3d &a = mesh.vertices[f[c]], &b = mesh.vertices[f[(c + 1) % 3]];
        for (const double along : {0.0, 0.1, 0.5, 1.0 / 3}) {
          rays.push_back({origin + offset, a + along * (b - a) - origin});
        }
      }
    }
    // The mesh is moved in double: 2⁻⁵² of 7e6 mm, on directions of about 45 mm.
    constexpr double kMoved = 1e-9;
    for (const RayHit& hit : trace(scene, rays)) {
      ASSERT_NE(hit.face, kNoHit);
      ASSERT_NEAR(hit.t, 1, kMoved);
    }
    std::vector<std::uint8_t> flags(rays.size());
    scene.occluded(rays, flags);
    EXPECT_EQ(std::count(flags.begin(), flags.end(), 1), std::ssize(rays));
  }
}

// Rays through the vertices and edges of a regular grid meet several faces at the same distance.
TEST(RayScene, AnswersDoNotDependOnTheOtherRaysOfTheBatch) {
  const RayScene scene(grid_box({16, 16, 16}, 16));
  std::vector<Ray> rays;
  for (int i = 0; i <= 64; ++i) {
    for (int j = 0; j <= 64; ++j) {
      rays.push_back({{0, 0, -40}, Eigen::Vector3d(i / 4.0 - 8, j / 4.0 - 8, 32)});
      rays.push_back({{i / 4.0 - 8, j / 4.0 - 8, -40}, {0, 0, 1}});
    }
  }
  const std::vector<RayHit> together = trace(scene, rays);
  std::vector<std::size_t> order(rays.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  RandomStream random(5);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(i)]);
  std::vector<Ray> shuffled;
  for (const std::size_t i : order) shuffled.push_back(rays[i]);
  const std::vector<RayHit> apart = trace(scene, shuffled);
  for (std::size_t i = 0; i < order.size(); ++i) {
    ASSERT_TRUE(equal(apart[i], together[order[i]])) << "ray " << order[i];
    ASSERT_TRUE(equal(trace(scene, rays[i]), together[i])) << "ray " << i;
  }
}

TEST(RayScene, OffsetsSizesAndFarEyesCostNoAccuracy) {
  const TriangleMesh mesh = lumpy_mesh(1, 4);
  RandomStream random(6);
  const Eigen::Vector3d eye = 3 * random_direction(random);
  const RayHit truth = trace(RayScene(mesh), {eye, -eye});
  ASSERT_NE(truth.face, kNoHit);
  for (const double size : {1e-30, 1e-3, 1e6, 1e30}) {
    const RayHit hit = trace(RayScene(scaled(mesh, size)), {size * eye, -size * eye});
    EXPECT_EQ(hit.face, truth.face) << size;
    EXPECT_NEAR(hit.t, truth.t, kHitRounding);
  }
  // From 1e7 radii away a float origin would be a whole radius off.
  const RayHit far = trace(RayScene(mesh), {1e7 * eye, -eye});
  EXPECT_EQ(far.face, truth.face);
  EXPECT_NEAR(far.t - (1e7 - 1), truth.t, 1e-8);
}

TEST(RayScene, UnusableRaysHitNothing) {
  const RayScene scene(grid_box({2, 2, 2}, 1));
  const double nan = std::nan("");
  const Ray good{{0.1, 0.2, -5}, {0, 0, 1}};
  ASSERT_NE(trace(scene, good).face, kNoHit);
  std::vector<Ray> rays(7, good);
  rays[0].origin.x() = nan;
  rays[1].direction.y() = nan;
  rays[2].direction.setZero();
  rays[3].origin.z() = -kInfinity;
  rays[4].direction.z() = kInfinity;
  rays[5].t_min = nan;
  rays[6].t_max = 3.9;
  for (const RayHit& hit : trace(scene, rays)) EXPECT_EQ(hit.face, kNoHit);
  for (const Ray& ray : rays) EXPECT_FALSE(is_occluded(scene, ray));
  // One bad ray does not spoil its packet.
  rays[6] = good;
  EXPECT_NE(trace(scene, rays)[6].face, kNoHit);
}

TEST(RayScene, LimitsOfTheRayAreKept) {
  const RayScene scene(grid_box({2, 2, 2}, 1));
  const Eigen::Vector3d origin(0.1, 0.2, -5), direction(0, 0, 1);
  EXPECT_NEAR(trace(scene, {origin, direction, 4.5}).t, 6, kHitRounding);
  EXPECT_EQ(trace(scene, {origin, direction, 6.5}).face, kNoHit);
  EXPECT_NEAR(trace(scene, {origin, direction, -kInfinity, 5}).t, 4, kHitRounding);
  EXPECT_TRUE(is_occluded(scene, {origin, direction, 0, 4.001}));
  EXPECT_FALSE(is_occluded(scene, {origin, direction, 4.001, 5.999}));
  EXPECT_EQ(trace(scene, {origin, direction, 5, 4}).face, kNoHit);
}

TEST(RayScene, BatchesOfEveryLength) {
  const RayScene scene(grid_box({2, 2, 2}, 1));
  for (std::size_t count = 0; count < 20; ++count) {
    const std::vector<Ray> rays(count, {{0.1, 0.2, -5}, {0, 0, 1}});
    for (const RayHit& hit : trace(scene, rays)) EXPECT_NEAR(hit.t, 4, kHitRounding);
  }
  std::vector<RayHit> hits(2);
  const std::vector<Ray> rays(3);
  EXPECT_THROW(scene.first_hits(rays, hits), std::invalid_argument);
}

TEST(RayScene, UnusableMeshesAreRefused) {
  EXPECT_THROW(RayScene(TriangleMesh{}), BadDataError);
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.faces[2][1] = 4;
  EXPECT_THROW(RayScene{mesh}, BadDataError);
  mesh = tetrahedron_mesh();
  mesh.vertices[1].y() = std::nan("");
  EXPECT_THROW(RayScene{mesh}, BadDataError);
  EXPECT_THROW(RayScene(scaled(tetrahedron_mesh(), 1e300)), BadDataError);
}

TEST(RayScene, FacesWithoutAreaAreSeenThrough) {
  TriangleMesh mesh = grid_box({2, 2, 2}, 1);
  mesh.faces.push_back({0, 0, 1});
  mesh.faces.push_back({2, 2, 2});
  EXPECT_NEAR(trace(RayScene(mesh), {{0.1, 0.2, -5}, {0, 0, 1}}).t, 4, kHitRounding);
  mesh.faces = {{0, 0, 0}};
  EXPECT_EQ(trace(RayScene(mesh), {{-1, -1, -5}, {0, 0, 1}}).face, kNoHit);
}

TEST(RayScene, UnusedVerticesMayLieAnywhere) {
  TriangleMesh mesh = grid_box({2, 2, 2}, 1);
  mesh.vertices.push_back({1e12, 0, 0});
  EXPECT_NEAR(trace(RayScene(mesh), {{0.1, 0.2, -5}, {0, 0, 1}}).t, 4, kHitRounding);
}

TEST(RayScene, CanBeMoved) {
  RayScene scene(tetrahedron_mesh());
  RayScene other = std::move(scene);
  scene = std::move(other);
  EXPECT_NE(trace(scene, {{0.1, 0.1, -5}, {0, 0, 1}}).face, kNoHit);
}

}  // namespace
}  // namespace organbake
