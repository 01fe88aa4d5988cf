// SPDX-License-Identifier: GPL-3.0-or-later
#include "support/organs.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <map>

#include "organbake/core/files.h"
#include "organbake/cutting/cut_skin.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "support/meshes.h"

namespace organbake {
namespace {

CameraMaps maps_of(const Intrinsics& k) {
  CameraMaps maps;
  maps.width = k.width;
  maps.height = k.height;
  for (int i = 0; i < k.width * k.height; ++i) {
    const bool there = i % 4 != 0;
    maps.depth_mm.push_back(there ? 9.5f + 0.01f * i : std::numeric_limits<float>::infinity());
    maps.color.emplace_back(there ? 0.5f : 0, there ? 0.25f : 0, 0);
    maps.height_mm.push_back(there ? 0.125f * (i % 3) : 0);
    maps.face.push_back(there ? i % 4 : kNoFace);
    maps.confidence.push_back(there ? 0.75f : 0);
  }
  return maps;
}

}  // namespace

Bundle small_bundle() {
  Bundle bundle;
  bundle.manifest.name = "small";
  bundle.manifest.generator = "tests";
  bundle.proxy = tetrahedron_mesh();
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0, -10, 0), Eigen::Vector3d(10, 0, 0)}) {
    bundle.cameras.cameras.push_back(
        {"v", {8, 6, 10, 10, 4, 3}, look_at(eye, {0, 0, 0}, Eigen::Vector3d::UnitZ())});
    bundle.cameras.manifold.directions.push_back(eye.normalized());
    bundle.maps.push_back(maps_of(bundle.cameras.cameras.back().intrinsics));
  }
  bundle.mechanics = {
      {0.1, 0.1, 0.1, 0.1}, {{0, 1, 1, 2, 0.5}, {2, 3, 1.5, 2, 0}}, {0}, {}, 10, 1060, 15, 1, 5};
  bundle.base = {2, 4, std::vector<float>(24, 0.5f),
                 std::vector<Eigen::Vector3f>(24, {0.5f, 0.25f, 0.125f}),
                 std::vector<std::uint32_t>(24, 3)};
  return bundle;
}

TetrahedralBody small_body() {
  TetrahedralBody body;
  body.nodes_mm = {{0, 0, 0}, {3, 0, 0}, {0, 3, 0}, {0, 0, 3}, {3, 3, 3.1}};
  body.tetrahedra = {{{0, 1, 2, 3}, 0.25}, {{1, 2, 3, 4}, 1}};
  body.vertices = {{0, {1, 0, 0, 0}},
                   {0, {0.1, 0.2, 0.3, 0.4}},
                   {1, {0.25, 0.25, 0.25, 0.25}},
                   {1, {0, 0, 0, 1}}};
  body.anchors = {0, 3};
  body.poisson_ratio = 0.3;
  body.damping_s = 0.01;
  return body;
}

void write_bundle(const std::filesystem::path& folder, const Bundle& bundle) {
  std::filesystem::create_directories(folder);
  write_ply(folder / "proxy.ply", bundle.proxy);
  write_file_atomically(folder / "cameras.json", cameras_to_json(bundle.cameras));
  write_file_atomically(folder / "mechanics.json", mechanics_to_json(bundle.mechanics));
  write_exr(folder / "base.exr", base_layer_to_image(bundle.base));
  if (bundle.skin) write_exr(folder / kSkinFile, skin_to_image(*bundle.skin));
  for (std::size_t c = 0; c < bundle.maps.size(); ++c) {
    const auto camera = folder / camera_folder(c);
    std::filesystem::create_directories(camera);
    write_exr(camera / "depth.exr", depth_image(bundle.maps[c]));
    write_exr(camera / "color.exr", color_image(bundle.maps[c]));
    write_exr(camera / "micro.exr", micro_image(bundle.maps[c]));
  }
  write_manifest(folder, bundle.manifest);
}

}  // namespace organbake

namespace organbake::test {
namespace {

using Keep = std::function<bool(const Eigen::Vector3d& low)>;

TetrahedralBody cubes_of(const Eigen::Vector3d& low, const Eigen::Array3i& count, double cell_mm,
                         const Keep& keep) {
  TetrahedralBody body;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto node = [&](int x, int y, int z) {
    const auto [at, made] =
        known.try_emplace({x, y, z}, static_cast<std::uint32_t>(body.nodes_mm.size()));
    if (made) body.nodes_mm.push_back(low + cell_mm * Eigen::Vector3d(x, y, z));
    return at->second;
  };
  for (int z = 0; z < count.z(); ++z) {
    for (int y = 0; y < count.y(); ++y) {
      for (int x = 0; x < count.x(); ++x) {
        if (!keep(low + cell_mm * Eigen::Vector3d(x, y, z))) continue;
        std::array<std::uint32_t, 8> c;
        for (int k = 0; k < 8; ++k) c[k] = node(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
        // Neighbours are cut as mirror images, so that their faces match.
        if ((x + y + z) % 2 != 0) {
          for (int k = 0; k < 8; k += 2) std::swap(c[k], c[k + 1]);
        }
        for (std::array<std::uint32_t, 4> t : {std::array{c[0], c[3], c[5], c[6]},
                                               {c[1], c[0], c[3], c[5]},
                                               {c[2], c[0], c[3], c[6]},
                                               {c[4], c[0], c[5], c[6]},
                                               {c[7], c[3], c[5], c[6]}}) {
          Tetrahedron made{t, 1};
          if (volume_of(body, made) < 0) std::swap(made.nodes[2], made.nodes[3]);
          body.tetrahedra.push_back(made);
        }
      }
    }
  }
  return body;
}

}  // namespace

TetrahedralBody block(const Eigen::Array3i& count, double cell_mm) {
  return cubes_of(Eigen::Vector3d::Zero(), count, cell_mm, [](const auto&) { return true; });
}

TetrahedralBody tissue_under(const TriangleMesh& skin, double cell_mm) {
  const Bounds box = bounds(skin);
  const SkinInside inside(skin, MaterialGrid(box.center()), 0);
  const Eigen::Vector3d low = box.min - Eigen::Vector3d::Constant(0.31 * cell_mm);
  const Eigen::Array3i count = ((box.max - low) / cell_mm).array().floor().cast<int>() + 1;
  TetrahedralBody body = cubes_of(low, count, cell_mm, [&](const Eigen::Vector3d& cell) {
    for (int k = 0; k < 27; ++k) {
      const Eigen::Vector3d at(k % 3, k / 3 % 3, k / 9);
      if (inside(cell + 0.5 * cell_mm * at)) return true;
    }
    return std::any_of(skin.vertices.begin(), skin.vertices.end(), [&](const Eigen::Vector3d& v) {
      return ((v - cell).array() >= 0).all() && ((v - cell).array() <= cell_mm).all();
    });
  });
  for (const Eigen::Vector3d& v : skin.vertices) {
    EmbeddedVertex best;
    double deepest = -1e300;
    for (std::uint32_t t = 0; t < body.tetrahedra.size(); ++t) {
      const auto gradients = gradients_of(body, body.tetrahedra[t]);
      const Eigen::Vector3d at = v - body.nodes_mm[body.tetrahedra[t].nodes[0]];
      std::array<double, 4> w;
      for (int k = 1; k < 4; ++k) w[k] = gradients.row(k).dot(at);
      w[0] = 1 - w[1] - w[2] - w[3];
      const double least = *std::min_element(w.begin(), w.end());
      if (least > deepest) deepest = least, best = {t, w};
    }
    for (double& w : best.weights) w = std::clamp(w, 0.0, 1.0);
    body.vertices.push_back(best);
  }
  for (std::uint32_t n = 0; n < body.nodes_mm.size(); ++n) {
    if (body.nodes_mm[n].y() < low.y() + 0.5 * cell_mm) body.anchors.push_back(n);
  }
  body.damping_s = 0.01;
  return body;
}

void add_stroke(const std::vector<Eigen::Vector3d>& tips, const Eigen::Vector3d& up,
                CutSheet& sheet) {
  sheet.begin_stroke();
  for (const Eigen::Vector3d& tip : tips) {
    BladeLine line;
    line.top_is_out = true;
    for (int k = 0; k < BladeLine::kRows; ++k)
      line.points_mm[k] = tip + std::max(0.0, (k - 1.0) / (BladeLine::kPoints - 1)) * up;
    sheet.add(line);
  }
}

EdgeCrossings crossings(const TetrahedralBody& body, const MaterialGrid& grid) {
  std::vector<GridPoint> points;
  for (const Eigen::Vector3d& node : body.nodes_mm)
    points.push_back(grid.snapped(node, static_cast<std::uint32_t>(points.size())));
  return EdgeCrossings(points, edges_of(body.tetrahedra));
}

double volume_mm3(const TetrahedralBody& body) {
  double sum = 0;
  for (const Tetrahedron& t : body.tetrahedra) sum += volume_of(body, t);
  return sum;
}

std::vector<double> fragment_volumes(const CutTetrahedra& cut, const TetrahedralBody& body) {
  std::vector<double> volumes(cut.fragment_count(), 0.0);
  for (std::uint32_t c = 0; c < cut.copies().size(); ++c) {
    const CutTetrahedra::Copy& copy = cut.copies()[c];
    volumes[cut.fragment(c)] += copy.share * volume_of(body, body.tetrahedra[copy.tetrahedron]);
  }
  return volumes;
}

bool is_closed(const TriangleMesh& mesh) {
  std::map<std::array<std::uint32_t, 2>, int> times;
  for (const Face& f : mesh.faces) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = f[k], b = f[(k + 1) % 3];
      times[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  return std::all_of(times.begin(), times.end(), [](const auto& t) { return t.second == 0; });
}

}  // namespace organbake::test
