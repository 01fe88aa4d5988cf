// SPDX-License-Identifier: GPL-3.0-or-later

#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/polygon.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/repair/repair.h"
#include "support/meshes.h"
#include "support/testing.h"
#include "voxel_mesh.h"

namespace organbake {
namespace {

// A mesh as segmentation programs, editors and converters leave it, and what it was made from.
struct BrokenMesh {
  std::string name;
  TriangleMesh mesh;
  TriangleMesh meant;       // sound: of the right shape and volume
  bool needs_wrap = false;  // nothing short of a wrap makes it an organ
  bool open = false;        // a surface with a border, and to stay one
};

using Eigen::Vector3d;
constexpr int kFine = 4;  // 5,120 faces
TriangleMesh organ() { return lumpy_mesh(40, kFine); }

std::uint32_t add_vertex(TriangleMesh& mesh, const Vector3d& at) {
  mesh.vertices.push_back(at);
  return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
}

// A number in 0…1 that looks random and is the same everywhere.
double noise(std::size_t i) {
  const double x = std::sin(12.9898 * double(i) + 4.1414) * 43758.5453;
  return x - std::floor(x);
}

TriangleMesh jittered_soup_of(const TriangleMesh& mesh, double jitter_mm) {
  TriangleMesh soup = soup_of(mesh);
  for (std::size_t n = 0; n < soup.vertices.size(); ++n)
    soup.vertices[n] += jitter_mm * Vector3d(noise(n), noise(n + 7), noise(n + 13));
  return soup;
}

TriangleMesh wound_at_random(TriangleMesh mesh) {
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (noise(f) < 0.4) std::swap(mesh.faces[f][1], mesh.faces[f][2]);
  return mesh;
}

TriangleMesh with_duplicates(TriangleMesh mesh, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    Face copy = mesh.faces[(i * 37) % mesh.faces.size()];
    if (i % 3 == 0) std::swap(copy[0], copy[2]);
    mesh.faces.push_back(copy);
  }
  return mesh;
}

TriangleMesh without_faces(TriangleMesh mesh, const std::function<bool(std::size_t)>& drop) {
  std::vector<Face> kept;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (!drop(f)) kept.push_back(mesh.faces[f]);
  mesh.faces = kept;
  return mesh;
}

TriangleMesh with_specks(TriangleMesh mesh, int count) {
  for (int i = 0; i < count; ++i) {
    const double angle = 2.4 * i, size_mm = 0.3 + 0.1 * (i % 5);
    const bool inside = i % 4 == 0;
    const double far_mm = inside ? 8 : 70 + 5 * i;
    mesh = joined(
        mesh, moved(sphere_mesh(size_mm, 1),
                    {far_mm * std::cos(angle), far_mm * std::sin(angle), inside ? 0.0 : 3.0 * i}));
  }
  return mesh;
}

// Faces that stand up from edges of the skin.
TriangleMesh with_fins(TriangleMesh mesh, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const Face face = mesh.faces[(i * 211) % (20 << 8)];
    const Vector3d middle = 0.5 * (mesh.vertices[face[0]] + mesh.vertices[face[1]]);
    mesh.faces.push_back({face[0], face[1], add_vertex(mesh, 1.08 * middle)});
  }
  return mesh;
}

// A wall across the inside, on a ring of the skin's own vertices: where two segments were joined.
TriangleMesh with_wall(TriangleMesh mesh) {
  // The equator of an icosphere's edges: vertices at z = 0 of the unit sphere it was made from.
  const TriangleMesh ball = sphere_mesh(1, kFine);
  std::vector<std::uint32_t> ring;
  for (std::uint32_t v = 0; v < ball.vertices.size(); ++v)
    if (std::abs(ball.vertices[v].z()) < 1e-9) ring.push_back(v);
  std::sort(ring.begin(), ring.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::atan2(ball.vertices[a].y(), ball.vertices[a].x()) <
           std::atan2(ball.vertices[b].y(), ball.vertices[b].x());
  });
  const std::uint32_t middle = add_vertex(mesh, Vector3d::Zero());
  for (std::size_t i = 0; i < ring.size(); ++i)
    mesh.faces.push_back({ring[i], ring[(i + 1) % ring.size()], middle});
  return mesh;
}

void merge_vertices(TriangleMesh& mesh, std::uint32_t from, std::uint32_t into) {
  for (Face& face : mesh.faces)
    for (std::uint32_t& v : face)
      if (v == from) v = into;
}

// Two lobes with one vertex in common.
TriangleMesh lobes_at_a_vertex() {
  TriangleMesh mesh = sphere_mesh(30, 3);
  const auto top = static_cast<std::uint32_t>(
      std::max_element(mesh.vertices.begin(), mesh.vertices.end(),
                       [](const Vector3d& a, const Vector3d& b) { return a.x() < b.x(); }) -
      mesh.vertices.begin());
  const auto count = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh = joined(mesh, moved(mirrored(mesh), {2 * mesh.vertices[top].x(), 0, 0}));
  merge_vertices(mesh, count + top, top);
  return mesh;
}

// Faces cut on one side of an edge only: a vertex lies in the middle of its neighbour's edge.
TriangleMesh with_t_junctions(TriangleMesh mesh, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t f = (i * 97) % (20 << 8);
    const Face face = mesh.faces[f];
    const std::uint32_t m =
        add_vertex(mesh, 0.5 * (mesh.vertices[face[0]] + mesh.vertices[face[1]]));
    mesh.faces[f] = {face[0], m, face[2]};
    mesh.faces.push_back({m, face[1], face[2]});
  }
  return mesh;
}

bool in_ball(int x, int y, int z, double radius) {
  return std::hypot(x - 11.5, y - 11.5, z - 11.5) < radius;
}

BrokenMesh voxels(const std::string& name, double share_of_pits) {
  const auto inside = [=](int x, int y, int z) {
    // Pits lie open: voids within are another thing than skin.
    const bool rim = !in_ball(x - 1, y, z, 10) || !in_ball(x + 1, y, z, 10) ||
                     !in_ball(x, y - 1, z, 10) || !in_ball(x, y + 1, z, 10) ||
                     !in_ball(x, y, z - 1, 10) || !in_ball(x, y, z + 1, 10);
    const std::size_t n = std::size_t(x) + 31 * std::size_t(y) + 977 * std::size_t(z);
    return in_ball(x, y, z, 10) && !(rim && noise(n) < share_of_pits);
  };
  const TriangleMesh mesh = voxel_mesh(24, 3, inside);
  return {name, mesh, mesh};
}

// A plate with holes through it, as thresholds leave it.
BrokenMesh plate_with_tunnels() {
  const auto holed = [](int x, int y, int z) { return z < 6 && !(x % 5 == 2 && y % 5 == 2); };
  const auto solid = [](int, int, int z) { return z < 6; };
  BrokenMesh broken{"many tunnels", voxel_mesh(20, 2, holed), voxel_mesh(20, 2, solid)};
  broken.needs_wrap = true;
  return broken;
}

// Two bodies stuck together: the wall between them is there twice, or once for each.
TriangleMesh stuck_bodies() {
  const auto left = [](int x, int y, int z) { return x < 6 && y < 8 && z < 8; };
  const auto right = [](int x, int y, int z) { return x >= 6 && x < 12 && y < 8 && z < 8; };
  return soup_of(joined(voxel_mesh(12, 4, left), voxel_mesh(12, 4, right)));
}

// A strip with half a turn hangs at the organ by one edge.
TriangleMesh with_mobius_strip(TriangleMesh mesh) {
  constexpr std::uint32_t kSteps = 24;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const double a = 2 * M_PI * i / kSteps;
    for (const double w : {-3.0, 3.0})
      mesh.vertices.emplace_back(80 + (12 + w * std::cos(a / 2)) * std::cos(a),
                                 (12 + w * std::cos(a / 2)) * std::sin(a), w * std::sin(a / 2));
  }
  const auto at = [&](std::uint32_t i, std::uint32_t side) {
    return first + 2 * (i % kSteps) + (i == kSteps ? 1 - side : side);
  };
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    mesh.faces.push_back({at(i, 0), at(i + 1, 0), at(i + 1, 1)});
    mesh.faces.push_back({at(i, 0), at(i + 1, 1), at(i, 1)});
  }
  return mesh;
}

// Twenty-four of them, anatomy-like: lumpy organs, lobes, vessels and voxels with non-manifold
// edges and vertices, tunnels, islands, duplicates, doubled vertices, mixed winding, holes, fins,
// walls.
std::vector<BrokenMesh> broken_meshes() {
  const TriangleMesh sound = organ();
  const auto every = [](std::size_t n) { return [n](std::size_t f) { return f % n == n / 2; }; };
  const TriangleMesh cavity = sphere_mesh(15, 3), lobe = sphere_mesh(30, 3);
  const TriangleMesh hollow = joined(sound, cavity);  // outward, as segmentations of cavities come
  const TriangleMesh lobes = joined(lobe, moved(lobe, {61, 0, 0}));
  const TriangleMesh touching = joined(lobe, moved(lobe, {60, 0, 0}));

  std::vector<BrokenMesh> all;
  all.push_back({"triangle soup", soup_of(sound), sound});
  all.push_back({"vertices doubled by rounding", jittered_soup_of(sound, 3e-5), sound});
  all.push_back({"mixed winding", wound_at_random(sound), sound});
  all.push_back({"inside out", inside_out(sound), sound});
  all.push_back({"duplicate faces, some turned", with_duplicates(sound, 400), sound});
  all.push_back({"islands", with_specks(sound, 22), sound});
  all.push_back({"single faces missing", without_faces(sound, every(250)), sound});
  all.push_back({"fins", with_fins(sound, 15), sound});
  all.push_back({"a wall inside", with_wall(sound), sound});
  all.push_back({"lobes that share a vertex", lobes_at_a_vertex(), touching});
  all.push_back({"two lobes apart", lobes, lobes});
  all.push_back({"a cavity wound as a solid", hollow, joined(sound, inside_out(cavity))});
  const TriangleMesh ring = torus_mesh(40, 9, 48, 16);
  all.push_back({"a vessel's loop", wound_at_random(ring), ring});
  all.push_back({"T-junctions", with_t_junctions(sound, 60), sound});
  all.push_back(voxels("voxels that touch at edges", 0.02));
  all.push_back(voxels("voxels eaten at the rim", 0.05));
  all.push_back(plate_with_tunnels());
  all.push_back({"bodies stuck together", stuck_bodies(),
                 voxel_mesh(12, 4, [](int, int y, int z) { return y < 8 && z < 8; })});
  all.push_back({"a Moebius strip beside it", with_mobius_strip(sound), sound});
  all.push_back({"fins, specks and holes",
                 with_specks(with_fins(without_faces(sound, every(500)), 9), 9), sound});
  all.push_back({"a soup of all: turned, twice, with specks",
                 soup_of(with_specks(with_duplicates(wound_at_random(sound), 100), 12)), sound});
  all.push_back({"a wall, turned faces and holes",
                 with_wall(without_faces(wound_at_random(sound), every(700))), sound});
  const TriangleMesh upper = cut_in_half(sound, Vector3d::UnitZ());
  BrokenMesh half{"half an organ with turned faces and fins",
                  with_duplicates(wound_at_random(upper), 50), upper};
  half.open = true;
  all.push_back(half);
  TriangleMesh flat = sound;
  for (std::size_t f = 0; f < 60; ++f) {
    const Face face = flat.faces[61 * f];
    const std::uint32_t m =
        add_vertex(flat, 0.5 * (flat.vertices[face[0]] + flat.vertices[face[1]]));
    flat.faces.push_back({face[0], m, face[1]});  // on a line
    flat.faces.push_back({face[0], face[0], face[2]});
  }
  all.push_back({"faces without an area", flat, sound});
  return all;
}

// What is said to have been done where nothing but these faces is wrong: all else stays as it was.
const std::map<std::string, std::string> kDone = {
    {"mixed winding", "faces that were wound against their neighbours turned"},
    {"duplicate faces, some turned", "400 duplicate faces dropped"},
    {"faces without an area", "faces without an area dropped"},
    {"fins", "15 faces of fins dropped"},
    {"a wall inside", "faces of walls inside dropped"}};
constexpr double kSame = 1e-9;  // of a volume: the same corners, other sums

// The targets where no wrap is needed: volume within 1 %, no point farther off than 0.5 mm.
constexpr double kVolumeShare = 0.01, kDistance_mm = 0.5;
// A wrap sags into what it closes, and rounds edges by some of the size that it closes.
constexpr double kWrapVolumeShare = 0.05;

class BrokenMeshes : public testing::TestWithParam<std::size_t> {};

TEST_P(BrokenMeshes, BecomeUsableOrgans) {
  const BrokenMesh broken = broken_meshes()[GetParam()];
  SCOPED_TRACE(broken.name);
  // As a bake does it: read_mesh welds, repair mends, decimate makes the proxy.
  TriangleMesh welded = broken.mesh;
  weld(welded);
  const RepairSummary repaired = repair(welded, {});
  const MeshTopology topology = analyse_topology(repaired.mesh);
  EXPECT_EQ(topology.non_manifold_edges, 0u);
  EXPECT_EQ(topology.non_manifold_vertices, 0u);
  EXPECT_EQ(topology.misoriented_edges, 0u);
  EXPECT_EQ(topology.closed_manifold(), !broken.open);
  EXPECT_EQ(repaired.wrapped, broken.needs_wrap);
  const auto done = kDone.find(broken.name);
  if (done != kDone.end()) {
    EXPECT_THAT(repaired.done, testing::Contains(testing::HasSubstr(done->second)));
  }
  if (!broken.open) {
    const double share = signed_volume(repaired.mesh) / signed_volume(broken.meant) - 1;
    EXPECT_LT(std::abs(share), done != kDone.end() ? kSame
                               : broken.needs_wrap ? kWrapVolumeShare
                                                   : kVolumeShare);
  }
  if (!broken.needs_wrap) {
    EXPECT_LT(largest_distance(broken.meant, repaired.mesh, RayScene(repaired.mesh)), kDistance_mm);
    EXPECT_LT(largest_distance(repaired.mesh, broken.meant, RayScene(broken.meant)), kDistance_mm);
  }
  const DecimateResult proxy = decimate(
      repaired.mesh, {.method = DecimateMethod::quadric, .faces = broken.open ? 200u : 400u});
  EXPECT_GT(proxy.proxy.faces.size(), 20u);
  EXPECT_EQ(proxy.closed_manifold, !broken.open);
}

INSTANTIATE_TEST_SUITE_P(All, BrokenMeshes, testing::Range(std::size_t{0}, broken_meshes().size()));

}  // namespace

}  // namespace organbake
