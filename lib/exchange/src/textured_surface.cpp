// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/textured_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "atlas.h"
#include "charts.h"
#include "organbake/core/error.h"
#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/exchange/base_surface.h"

namespace organbake {
namespace {

constexpr int kMargin = 4;  // texels round each chart: two levels of a mip map keep charts apart
constexpr int kSideStep = 256, kLargestFoundSide = 4096;

struct FlatBox {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
};

FlatBox flat_box(const TriangleMesh& mesh, const Chart& chart) {
  FlatBox box;
  for (const std::uint32_t face : chart.faces)
    for (const std::uint32_t vertex : mesh.faces[face]) {
      const Eigen::Vector2d at = chart.flat(mesh.vertices[vertex]);
      box.low = box.low.cwiseMin(at);
      box.high = box.high.cwiseMax(at);
    }
  return box;
}

// In texels of the atlas; the scale is in texels a millimetre.
struct Layout {
  int side = 0;
  double scale = 1;
  std::vector<Eigen::Vector2d> offsets;  // of each chart's flat places
};

Layout laid_out(const TriangleMesh& mesh, const std::vector<Chart>& charts, int asked_side,
                double texel_mm) {
  std::vector<Eigen::Vector2d> sizes, lows;
  double largest_mm = 1e-9;
  for (const Chart& chart : charts) {
    const FlatBox box = flat_box(mesh, chart);
    lows.push_back(box.low);
    sizes.push_back(box.high - box.low);
    largest_mm = std::max(largest_mm, sizes.back().maxCoeff());
  }
  Layout layout;
  PackedRectangles packed;
  if (asked_side > 0) {
    layout.side = asked_side;
    packed = pack_rectangles(sizes, kMargin, layout.side, layout.side / largest_mm);
  } else {
    do {
      layout.side += kSideStep;
      packed = pack_rectangles(sizes, kMargin, layout.side, 1 / texel_mm);
    } while (packed.scale < 1 / texel_mm && layout.side < kLargestFoundSide);
  }
  if (!(packed.scale > 0)) {
    throw UsageError("--texture " + std::to_string(layout.side) + " has no room for the " +
                     std::to_string(charts.size()) +
                     " pieces of the surface; take a larger texture, or fewer faces");
  }
  layout.scale = packed.scale;
  for (std::size_t c = 0; c < charts.size(); ++c)
    layout.offsets.push_back(packed.corners[c].cast<double>() - layout.scale * lows[c]);
  return layout;
}

// The direction of u on the surface: along the chart's u, raised onto the vertex's plane.
Eigen::Vector3d tangent_of(const Chart& chart, const Eigen::Vector3d& normal) {
  constexpr double kSteepest = 0.1;  // cosine; beyond, the raised vector would run away
  const double facing = normal.dot(chart.axis);
  const Eigen::Vector3d raised =
      facing > kSteepest ? Eigen::Vector3d(chart.u - normal.dot(chart.u) / facing * chart.axis)
                         : Eigen::Vector3d(chart.u - normal.dot(chart.u) * normal);
  const double length = raised.norm();
  return length > kSteepest ? Eigen::Vector3d(raised / length) : normal.unitOrthogonal();
}

TriangleMesh reduced(const TriangleMesh& base, std::size_t faces, const RunContext& context) {
  TriangleMesh mesh = base;
  mesh.colors.clear();
  if (faces == 0 || mesh.faces.size() <= faces) return mesh;
  // Lindstrom and Turk's order of edges is worth its time for the last few halvings alone.
  constexpr std::size_t kFastDownTo = 6;
  mesh = manifold_faces(mesh);
  if (mesh.faces.size() > kFastDownTo * faces)
    mesh = fast_collapse(mesh, kFastDownTo * faces, context);
  return collapse_edges(mesh, faces, context);
}

// Blinn's exponent as the roughness of a GGX lobe of the same width (Walter et al. 2007).
double roughness_of(const std::optional<Lighting>& lighting) {
  if (!lighting || lighting->gloss.empty()) return 1;
  const auto strongest = std::max_element(
      lighting->gloss.begin(), lighting->gloss.end(),
      [](const Lighting::Lobe& a, const Lighting::Lobe& b) { return a.strength < b.strength; });
  return std::sqrt(std::sqrt(2 / (strongest->exponent + 2)));
}

// Corners, coordinates and tangents of all charts.
void lay_flat(const TriangleMesh& mesh, const std::vector<Chart>& charts, const Layout& layout,
              TexturedMesh& result) {
  for (std::size_t c = 0; c < charts.size(); ++c) {
    std::unordered_map<std::uint32_t, std::uint32_t> coordinate_of;
    for (const std::uint32_t face : charts[c].faces) {
      std::array<TexturedMesh::Corner, 3> corners;
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t vertex = mesh.faces[face][k];
        const auto [at, is_new] =
            coordinate_of.emplace(vertex, static_cast<std::uint32_t>(result.coordinates.size()));
        corners[k] = {vertex, at->second};
        if (!is_new) continue;
        const Eigen::Vector2d texel =
            layout.scale * charts[c].flat(mesh.vertices[vertex]) + layout.offsets[c];
        result.coordinates.push_back(texel / layout.side);
        result.tangents.push_back(tangent_of(charts[c], result.normals[vertex]));
      }
      result.faces.push_back(corners);
    }
  }
}

}  // namespace

void TexturedSurfaceOptions::check() const {
  if (faces != 0 && faces < 20) throw UsageError("--faces must be 0 (all) or at least 20");
  if (texture_side != 0 && (texture_side < 64 || texture_side > 8192))
    throw UsageError("--texture must be 64…8192 texels, or auto");
}

TexturedMesh textured_surface(const Bundle& bundle, const TexturedSurfaceOptions& options,
                              const RunContext& context) {
  options.check();
  if (options.albedo && !bundle.lighting) {
    throw UsageError(
        "--albedo needs a bundle that knows the light of its colours (lighting.json); this one "
        "does not, so its colours can only be exported as they were baked");
  }
  const FineSurface fine(bundle, base_surface(bundle));
  context.progress(0.1);
  const TriangleMesh mesh = reduced(fine.mesh(), options.faces, context);
  context.progress(0.4);
  const std::vector<Chart> charts = cut_into_charts(mesh);
  const Layout layout = laid_out(mesh, charts, options.texture_side, fine.texel_mm());
  context.throw_if_cancelled();

  TexturedMesh result;
  result.vertices = mesh.vertices;
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    result.normals.push_back(fine.at(vertex).normal);
  lay_flat(mesh, charts, layout, result);
  result.roughness = roughness_of(bundle.lighting);
  context.progress(0.5);
  bake_atlas(fine, options.albedo ? &*bundle.lighting : nullptr, layout.side, result);
  return result;
}

}  // namespace organbake
