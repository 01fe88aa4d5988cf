// SPDX-License-Identifier: GPL-3.0-or-later
// The colours of a surface: its own, a material's, a photograph's tissue, or posed photographs
// blended by weights that are continuous over the surface. In a blend of photographs one that is
// brighter than the others counts less: highlights move with the photographer.
#include "organbake/capture/surface_color.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "baking.h"
#include "organbake/capture/solid_noise.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/refine.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

class VertexColor : public SurfaceColor {
 public:
  explicit VertexColor(const TriangleMesh& surface)
      : faces_(surface.faces), colors_(surface.colors), edge_mm_(mean_edge_length(surface)) {}

  double detail_mm() const override { return edge_mm_; }

  void shade(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>&,
             const std::vector<RayHit>& hits, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [a, b, c] = faces_[hits[i].face];
      const float u = hits[i].u, v = hits[i].v;
      colors[i] = (1 - u - v) * colors_[a] + u * colors_[b] + v * colors_[c];
    }
  }

 private:
  std::vector<Face> faces_;
  std::vector<Eigen::Vector3f> colors_;
  double edge_mm_;
};

using Eigen::Vector3d;

class MaterialColor : public SurfaceColor {
 public:
  explicit MaterialColor(const Material& material)
      : material_(material),
        lighting_(material.lighting()),
        spots_(kSpotSeed, material.feature_mm),
        grain_(kSpotSeed + 1, material.feature_mm / kGrainsPerSpot) {}

  double detail_mm() const override { return material_.feature_mm / kGrainsPerSpot; }

  void shade(const std::vector<Vector3d>& points, const std::vector<Vector3d>& normals,
             const std::vector<RayHit>&, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double noise = spots_.value(points[i]) + 0.6 * grain_.value(points[i]);
      const double tone = std::max(0.0, 1 + 2.0 * material_.variation * noise);
      colors[i] =
          (material_.albedo.cast<double>().cwiseProduct(lighting_.diffuse(normals[i])) * tone)
              .cast<float>();
    }
  }

 private:
  static constexpr std::uint64_t kSpotSeed = 20;  // one look for all bakes
  static constexpr double kGrainsPerSpot = 2.6;

  Material material_;
  Lighting lighting_;
  SolidNoise spots_, grain_;
};

// An albedo in a light, as Material::lighting() has it.
template <class Albedo>
class LitAlbedo : public SurfaceColor {
 public:
  LitAlbedo(Albedo albedo, const Lighting& lighting, double detail_mm)
      : albedo_(std::move(albedo)), lighting_(lighting), detail_mm_(detail_mm) {}

  double detail_mm() const override { return detail_mm_; }

  void shade(const std::vector<Vector3d>& points, const std::vector<Vector3d>& normals,
             const std::vector<RayHit>&, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      colors[i] = albedo_.at(points[i], normals[i])
                      .cwiseProduct(lighting_.diffuse(normals[i]).cast<float>());
  }

 private:
  Albedo albedo_;
  Lighting lighting_;
  double detail_mm_;
};

using Eigen::Vector3f;

// Below this sum of weights (a good photo alone has about 1) the carried colours take over.
constexpr float kFaintWeight = 0.004f;
// From this on, a vertex counts as seen and colours are carried from it.
constexpr float kSeenWeight = 0.02f;

struct Blend {
  Vector3f sum = Vector3f::Zero();
  float weight = 0;
};

float brightness(const Vector3f& color) { return luminance(color[0], color[1], color[2]); }

// Highlights move with the photographer, the colour below does not: a photo brighter than the
// others' (power) mean counts less, down to a tenth. The mean leans to the dark, and the floor
// keeps one wrong dark pixel from taking over. Continuous in weights and colours.
Blend blend(const std::vector<PhotoView::Look>& looks) {
  constexpr float kBrighter = 0.1f;  // by this share of the mean: counts half
  constexpr float kFloor = 0.1f;
  constexpr float kBlack = 0.002f;
  float weights = 0, inverse_squares = 0;
  for (const auto& look : looks) {
    const float bright = brightness(look.color) + kBlack;
    weights += look.weight;
    inverse_squares += look.weight / (bright * bright);
  }
  Blend result;
  if (!(weights > 0)) return result;
  const float mean = std::sqrt(weights / inverse_squares);
  for (const auto& look : looks) {
    const float excess =
        std::max(0.0f, brightness(look.color) + kBlack - mean) / (kBrighter * mean);
    const float weight = look.weight * (kFloor + (1 - kFloor) / (1 + excess * excess));
    result.sum += weight * look.color;
    result.weight += weight;
  }
  return result;
}

class PhotoColor : public SurfaceColor {
 public:
  PhotoColor(const TracedSurface& surface, std::vector<Photo> photos) : faces_(surface.mesh.faces) {
    for (Photo& photo : photos) views_.emplace_back(std::move(photo), surface);
    carry_colors(surface);
  }

  void shade(const std::vector<Vector3d>& points, const std::vector<Vector3d>& normals,
             const std::vector<RayHit>& hits, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    std::vector<PhotoView::Look> looks;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Blend photos = blend_photos(points[i], normals[i], looks);
      colors[i] = (photos.sum + kFaintWeight * carried(hits[i])) / (photos.weight + kFaintWeight);
    }
  }

 private:
  // `looks` is scratch, the caller's so that it is allocated once.
  Blend blend_photos(const Vector3d& point, const Vector3d& normal,
                     std::vector<PhotoView::Look>& looks) const {
    looks.clear();
    for (const PhotoView& view : views_) {
      const PhotoView::Look look = view.look_at_point(point, normal);
      if (look.weight > 0) looks.push_back(look);
    }
    return blend(looks);
  }

  Vector3f carried(const RayHit& hit) const {
    const auto& [a, b, c] = faces_[hit.face];
    const float u = hit.u, v = hit.v;
    return (1 - u - v) * carried_[a] + u * carried_[b] + v * carried_[c];
  }

  // A large face may be seen although no corner is (corners sit on outlines), so a corner takes
  // part of what the photos see inside its faces.
  void carry_colors(const TracedSurface& traced) {
    const TriangleMesh& surface = traced.mesh;
    std::vector<Blend> in_face(surface.faces.size()), at_vertex(surface.vertices.size());
    constexpr std::size_t kFacesAtOnce = 256;
    parallel_pieces(std::size_t{0}, surface.faces.size(), kFacesAtOnce,
                    [&](std::size_t first, std::size_t last) {
                      std::vector<PhotoView::Look> looks;
                      for (std::size_t f = first; f < last; ++f) {
                        RayHit middle;
                        middle.face = static_cast<std::uint32_t>(f);
                        middle.u = middle.v = 1.0f / 3;
                        in_face[f] = blend_photos(traced.normals.point(middle),
                                                  traced.normals.at(middle), looks);
                      }
                    });
    for (std::size_t f = 0; f < surface.faces.size(); ++f)
      for (const std::uint32_t v : surface.faces[f]) {
        at_vertex[v].sum += in_face[f].sum;
        at_vertex[v].weight += in_face[f].weight;
      }
    std::vector<char> known(surface.vertices.size(), 0);
    carried_.assign(surface.vertices.size(), Vector3f::Zero());
    for (std::size_t v = 0; v < known.size(); ++v) {
      if (at_vertex[v].weight < kSeenWeight) continue;
      known[v] = 1;
      carried_[v] = at_vertex[v].sum / at_vertex[v].weight;
    }
    flood_colors(surface, known, carried_);
  }

  std::vector<Face> faces_;
  std::vector<PhotoView> views_;
  std::vector<Vector3f> carried_;  // by vertex
};

}  // namespace

std::unique_ptr<SurfaceColor> make_vertex_color(const TriangleMesh& surface) {
  check_mesh(surface, "surface");
  if (surface.colors.empty())
    throw BadDataError("surface: it has no vertex colours; give photos or a material instead");
  for (const Eigen::Vector3f& color : surface.colors)
    if (!color.allFinite()) throw BadDataError("surface: a vertex colour is not a finite number");
  return std::make_unique<VertexColor>(surface);
}

Lighting Material::lighting() const {
  const Vector3d sky = Vector3d::Constant(ambient);
  Lighting lighting;
  lighting.ambient_above = lighting.ambient_below = sky;
  lighting.lamps = {{light_direction.normalized(), Vector3d::Constant(1 - ambient)}};
  if (tissue == Tissue::plain) return lighting;
  const TissueLook& look = tissue_look(tissue);
  lighting.gloss = look.gloss;
  constexpr double kBeam_rad = 0.5;  // the field of a laparoscopy is dark at its rim
  lighting.scope = ScopeLight{.beam_half_angle_rad = kBeam_rad, .gain = look.exposure};
  lighting.finish = look.finish;
  return lighting;
}

void Material::check() const {
  const auto share = [](const std::string& name, double value) {
    require(value >= 0 && value <= 1, name, value, "take 0…1");
  };
  share("albedo red", albedo[0]);
  share("albedo green", albedo[1]);
  share("albedo blue", albedo[2]);
  share("variation", variation);
  share("ambient", ambient);
  require(feature_mm >= 0.01f && feature_mm <= 1000, "feature_mm", feature_mm, "take 0.01…1000 mm");
  const Material plain;
  if (tissue != Tissue::plain &&
      (albedo != plain.albedo || variation != plain.variation || feature_mm != plain.feature_mm))
    throw UsageError(
        "albedo, variation and feature are of the plain material: a tissue by name has its own; "
        "leave them out, or take material plain");
  if (!light_direction.allFinite() || !(light_direction.norm() > 1e-9))
    throw UsageError("light_direction: take three finite numbers, not all zero");
}

std::unique_ptr<SurfaceColor> make_material_color(const Material& material) {
  material.check();
  if (material.tissue == Tissue::plain) return std::make_unique<MaterialColor>(material);
  TissueAlbedo albedo(tissue_look(material.tissue));
  const double detail_mm = albedo.detail_mm();
  return std::make_unique<LitAlbedo<TissueAlbedo>>(std::move(albedo), material.lighting(),
                                                   detail_mm);
}

ExemplarLook make_exemplar_color(const ExemplarPhoto& photo, Material material) {
  material.check();
  if (material.tissue == Tissue::plain) material.tissue = Tissue::liver;
  const Lighting lighting = material.lighting();
  const double detail_mm = 4 * photo.mm_per_pixel;  // a photograph is smooth over pairs of pixels
  return {std::make_unique<LitAlbedo<ExemplarTexture>>(ExemplarTexture(Exemplar(photo)), lighting,
                                                       detail_mm),
          lighting};
}

std::unique_ptr<SurfaceColor> make_photo_color(const TracedSurface& surface,
                                               std::vector<Photo> photos) {
  if (photos.empty())
    throw BadDataError("photos: none given; give at least one, or colour by vertex or material");
  return std::make_unique<PhotoColor>(surface, std::move(photos));
}

TriangleMesh colored_surface(const TracedSurface& surface, const SurfaceColor& color,
                             double finest_mm) {
  RefinedMesh fine = refine_edges(
      surface.mesh, finest_mm > 0 ? finest_mm : std::numeric_limits<double>::infinity());
  fine.mesh.colors.resize(fine.mesh.vertices.size());
  constexpr std::size_t kPiece = 2048;  // enough work for a thread, few enough to stay in cache
  const auto color_piece = [&](std::size_t first, std::size_t last) {
    std::vector<Eigen::Vector3d> points, at;
    std::vector<RayHit> hits;
    for (std::size_t i = first; i < last; ++i) {
      const SurfacePlace& place = fine.places[i];
      hits.push_back({place.face, 0, place.u, place.v});
      points.push_back(fine.mesh.vertices[i]);
      at.push_back(surface.normals.at(hits.back()));
    }
    std::vector<Eigen::Vector3f> shaded;
    color.shade(points, at, hits, shaded);
    std::copy(shaded.begin(), shaded.end(),
              fine.mesh.colors.begin() + static_cast<std::ptrdiff_t>(first));
  };
  parallel_pieces(std::size_t{0}, fine.mesh.vertices.size(), kPiece, color_piece);
  return std::move(fine.mesh);
}

}  // namespace organbake
