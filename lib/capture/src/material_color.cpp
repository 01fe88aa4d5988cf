// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "organbake/capture/solid_noise.h"
#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "tissue_color.h"

namespace organbake {
namespace {

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

class TissueColor : public SurfaceColor {
 public:
  explicit TissueColor(const Material& material)
      : lighting_(material.lighting()), albedo_(tissue_look(material.tissue)) {}

  double detail_mm() const override { return albedo_.detail_mm(); }

  void shade(const std::vector<Vector3d>& points, const std::vector<Vector3d>& normals,
             const std::vector<RayHit>&, std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      colors[i] = albedo_.at(points[i], normals[i])
                      .cwiseProduct(lighting_.diffuse(normals[i]).cast<float>());
  }

 private:
  Lighting lighting_;
  TissueAlbedo albedo_;
};

}  // namespace

Lighting Material::lighting() const {
  const Vector3d sky = Vector3d::Constant(ambient);
  Lighting lighting;
  lighting.ambient_above = lighting.ambient_below = sky;
  lighting.lamps = {{light_direction.normalized(), Vector3d::Constant(1 - ambient)}};
  if (tissue == Tissue::plain) return lighting;
  const TissueLook& look = tissue_look(tissue);
  lighting.gloss = look.gloss;
  lighting.scope = ScopeLight();
  lighting.finish = look.finish;
  return lighting;
}

void Material::check() const {
  const auto share = [](const std::string& name, double value) {
    if (!(value >= 0 && value <= 1)) throw UsageError(name + " = " + to_text(value) + ": take 0…1");
  };
  share("albedo red", albedo[0]);
  share("albedo green", albedo[1]);
  share("albedo blue", albedo[2]);
  share("variation", variation);
  share("ambient", ambient);
  if (!(feature_mm >= 0.01f && feature_mm <= 1000))
    throw UsageError("feature_mm = " + to_text(feature_mm) + ": take 0.01…1000 mm");
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
  if (material.tissue != Tissue::plain) return std::make_unique<TissueColor>(material);
  return std::make_unique<MaterialColor>(material);
}

}  // namespace organbake
