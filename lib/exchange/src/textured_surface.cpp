// SPDX-License-Identifier: GPL-3.0-or-later
// A bundle's surface for programs that draw with a GPU: reduced to a number of faces, laid flat in
// charts (charts.h), with one atlas of colours and normals. Texels ask the bundle's base layer for
// its shape and the maps for what they show; the rest is filled from around, so that no filter
// mixes in black.
#include "organbake/exchange/exchange.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "charts.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/decimate/decimate.h"
#include "organbake/decimate/mesh_measures.h"
#include "organbake/image/grow.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

// The surface as fine as a bundle has it: the base layer for its shape, the maps for what they show
// of it. Thread-safe after construction.
class FineSurface {
 public:
  struct Appearance {
    Eigen::Vector3d normal;       // of the base layer, smooth over its faces
    Eigen::Vector3d fine_normal;  // as the maps have it, where they show it
    Eigen::Vector3f color;        // linear
  };

  FineSurface(const Bundle& bundle, TriangleMesh base)
      : base_(std::move(base)), normals_(vertex_normals(base_)), scene_(base_), maps_(bundle) {}
  const TriangleMesh& mesh() const { return base_; }
  double texel_mm() const { return maps_.texel_mm(); }
  // At the closest point of the surface.
  Appearance at(const Eigen::Vector3d& point) const {
    const ClosestPoint closest = scene_.closest_point(point);
    const auto [a, b, c] = base_.faces[closest.face];
    // Weights of the corners by areas, of a point that lies in the face.
    const Eigen::Vector3d e1 = base_.vertices[b] - base_.vertices[a],
                          e2 = base_.vertices[c] - base_.vertices[a],
                          d = closest.point - base_.vertices[a], n = e1.cross(e2);
    const double doubled = n.squaredNorm();
    const double w1 = doubled > 0 ? std::clamp(d.cross(e2).dot(n) / doubled, 0.0, 1.0) : 0;
    const double w2 = doubled > 0 ? std::clamp(e1.cross(d).dot(n) / doubled, 0.0, 1.0 - w1) : 0;
    const double w0 = 1 - w1 - w2;
    Appearance look;
    look.normal = (w0 * normals_[a] + w1 * normals_[b] + w2 * normals_[c]).normalized();
    look.fine_normal = look.normal;
    if (const auto sample = maps_.at(closest.point, look.normal)) {
      look.color = sample->color;
      look.fine_normal = sample->normal;
      return look;
    }
    look.color = static_cast<float>(w0) * base_.colors[a] +
                 static_cast<float>(w1) * base_.colors[b] +
                 static_cast<float>(w2) * base_.colors[c];
    return look;
  }

 private:
  TriangleMesh base_;
  std::vector<Eigen::Vector3d> normals_;
  RayScene scene_;
  MapSampler maps_;
};

constexpr std::uint32_t kFree = 0xFFFFFFFFu;
constexpr float kBeyond = 1.5f;   // texels outside a face that a bilinear filter may still ask for
constexpr int kPaddedRings = 16;  // beyond those, for coarser levels of a mip map
using Weights = std::array<double, 3>;

// Of the corners at a point of the plane; they sum to 1.
Weights weights_at(const std::array<Eigen::Vector2d, 3>& t, const Eigen::Vector2d& p) {
  const Eigen::Vector2d e1 = t[1] - t[0], e2 = t[2] - t[0], d = p - t[0];
  const double area = e1.x() * e2.y() - e1.y() * e2.x();
  const double b1 = (d.x() * e2.y() - d.y() * e2.x()) / area;
  const double b2 = (e1.x() * d.y() - e1.y() * d.x()) / area;
  return {1 - b1 - b2, b1, b2};
}

// A face in texels, x right and y down from the atlas's top left corner.
std::array<Eigen::Vector2d, 3> texel_corners(const TexturedMesh& mesh, std::size_t face, int side) {
  std::array<Eigen::Vector2d, 3> corners;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d& uv = mesh.coordinates[mesh.faces[face][k].coordinate];
    corners[k] = {side * uv.x(), side * (1 - uv.y())};
  }
  return corners;
}

// Which face each texel shows: the one it lies in, or the nearest within kBeyond.
std::vector<std::uint32_t> owners(const TexturedMesh& mesh, int side) {
  std::vector<std::uint32_t> owner(std::size_t(side) * side, kFree);
  std::vector<float> depth_inside(owner.size(), -kBeyond);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const auto corners = texel_corners(mesh, f, side);
    std::array<double, 3> height;  // of the corner over the edge against it
    const Eigen::Vector2d e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
    const double doubled = std::abs(e1.x() * e2.y() - e1.y() * e2.x());
    if (!(doubled > 0)) continue;
    Eigen::Vector2d low = corners[0], high = corners[0];
    for (int k = 0; k < 3; ++k) {
      height[k] = doubled / (corners[(k + 2) % 3] - corners[(k + 1) % 3]).norm();
      low = low.cwiseMin(corners[k]);
      high = high.cwiseMax(corners[k]);
    }
    const auto clamped = [&](double at) {
      return std::clamp(static_cast<int>(std::floor(at)), 0, side - 1);
    };
    for (int y = clamped(low.y() - kBeyond); y <= clamped(high.y() + kBeyond); ++y)
      for (int x = clamped(low.x() - kBeyond); x <= clamped(high.x() + kBeyond); ++x) {
        const Weights w = weights_at(corners, {x + 0.5, y + 0.5});
        const auto inside =
            static_cast<float>(std::min({w[0] * height[0], w[1] * height[1], w[2] * height[2]}));
        float& best = depth_inside[std::size_t(y) * side + x];
        if (inside <= best) continue;
        best = inside;
        owner[std::size_t(y) * side + x] = f;
      }
  }
  return owner;
}

// Free texels take the mean of their neighbours, ring by ring; what is left `elsewhere`.
void pad(Rgb8Image& image, const std::vector<std::uint32_t>& owner,
         std::array<std::uint8_t, 3> elsewhere) {
  std::vector<std::uint8_t> known(owner.size());
  for (std::size_t i = 0; i < owner.size(); ++i) known[i] = owner[i] != kFree;
  grow(image.width, image.height, kPaddedRings, known,
       [&](std::size_t texel, std::span<const std::size_t> beside) {
         const std::size_t count = beside.size();
         for (int k = 0; k < 3; ++k) {
           std::size_t sum = 0;
           for (const std::size_t other : beside) sum += image.pixels[3 * other + k];
           image.pixels[3 * texel + k] = static_cast<std::uint8_t>((sum + count / 2) / count);
         }
       });
  for (std::size_t i = 0; i < known.size(); ++i)
    if (!known[i]) std::copy(elsewhere.begin(), elsewhere.end(), &image.pixels[3 * i]);
}

std::array<std::uint8_t, 3> mean_color(const Rgb8Image& image,
                                       const std::vector<std::uint32_t>& owner) {
  double sum[3] = {};
  double count = 0;
  for (std::size_t i = 0; i < owner.size(); ++i) {
    if (owner[i] == kFree) continue;
    for (int k = 0; k < 3; ++k) sum[k] += image.pixels[3 * i + k];
    ++count;
  }
  std::array<std::uint8_t, 3> mean{};
  for (int k = 0; k < 3; ++k)
    mean[k] = static_cast<std::uint8_t>(std::lround(sum[k] / std::max(1.0, count)));
  return mean;
}

// Fills a mesh's colour and normal maps, side × side texels: every texel whose middle lies in a
// face or within a texel and a half of one from the fine surface at that place, the rest from its
// neighbours. `light`: that the colours are freed from, or null.
class AtlasBaker {
 public:
  AtlasBaker(const FineSurface& fine, const Lighting* light, int side, TexturedMesh& mesh)
      : fine_(fine), light_(light), side_(side), mesh_(mesh) {}

  void run() {
    mesh_.color = Rgb8Image(side_, side_);
    mesh_.normal_map = Rgb8Image(side_, side_);
    const std::vector<std::uint32_t> owner = owners(mesh_, side_);
    parallel_for(0, side_, [&](int y) {
      for (int x = 0; x < side_; ++x) {
        const std::uint32_t face = owner[std::size_t(y) * side_ + x];
        if (face != kFree) fill(x, y, face);
      }
    });
    pad(mesh_.color, owner, mean_color(mesh_.color, owner));
    pad(mesh_.normal_map, owner, {128, 128, 255});
  }

 private:
  void fill(int x, int y, std::uint32_t face) {
    const Weights w = weights_at(texel_corners(mesh_, face, side_), {x + 0.5, y + 0.5});
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), normal = place, tangent = place;
    for (int k = 0; k < 3; ++k) {
      const TexturedMesh::Corner& corner = mesh_.faces[face][k];
      place += w[k] * mesh_.vertices[corner.vertex];
      normal += w[k] * mesh_.normals[corner.vertex];
      tangent += w[k] * mesh_.tangents[corner.coordinate];
    }
    const FineSurface::Appearance at = fine_.at(place);
    Eigen::Vector3f color = at.color;
    if (light_) {
      const Eigen::Vector3f diffuse = light_->diffuse(at.fine_normal).cast<float>();
      constexpr float kDarkest = 0.02f;  // of the light that is divided by
      color = color.cwiseQuotient(diffuse.cwiseMax(kDarkest));
    }
    for (int k = 0; k < 3; ++k) mesh_.color.at(x, y)[k] = srgb8_from_linear(color[k]);

    // As a viewer does it: both interpolated and made unit, the third from them.
    normal.normalize();
    tangent.normalize();
    const Eigen::Vector3d across = normal.cross(tangent);
    const double components[3] = {tangent.dot(at.fine_normal), across.dot(at.fine_normal),
                                  normal.dot(at.fine_normal)};
    for (int k = 0; k < 3; ++k)
      mesh_.normal_map.at(x, y)[k] = static_cast<std::uint8_t>(
          std::lround(std::clamp(0.5 * (components[k] + 1), 0.0, 1.0) * 255));
  }

  const FineSurface& fine_;
  const Lighting* light_;
  int side_;
  TexturedMesh& mesh_;
};

constexpr int kMargin = 4;  // texels round each chart: two levels of a mip map keep charts apart
constexpr int kSideStep = 256, kLargestFoundSide = 4096;

Eigen::AlignedBox2d flat_box(const TriangleMesh& mesh, const Chart& chart) {
  Eigen::AlignedBox2d box;
  for (const std::uint32_t face : chart.faces)
    for (const std::uint32_t vertex : mesh.faces[face])
      box.extend(chart.flat(mesh.vertices[vertex]));
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
    const Eigen::AlignedBox2d box = flat_box(mesh, chart);
    lows.push_back(box.min());
    sizes.push_back(box.sizes());
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
  if (!(packed.scale > 0))
    throw UsageError("--texture " + std::to_string(layout.side) + " has no room for the " +
                     std::to_string(charts.size()) +
                     " pieces of the surface; take a larger texture, or fewer faces");
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
  if (options.albedo && !bundle.lighting)
    throw UsageError(
        "--albedo needs a bundle that knows the light of its colours (lighting.json); this one "
        "does not, so its colours can only be exported as they were baked");
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
  const Lighting* const light = options.albedo ? &*bundle.lighting : nullptr;
  AtlasBaker(fine, light, layout.side, result).run();
  return result;
}

}  // namespace organbake
