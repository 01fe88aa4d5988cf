// SPDX-License-Identifier: Apache-2.0
#include "support/cut_bodies.h"

#include <algorithm>
#include <functional>
#include <map>

#include "organbake/cutting/cut_skin.h"

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
