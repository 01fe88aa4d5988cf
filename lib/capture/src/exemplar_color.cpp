// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/surface_color.h"

namespace organbake {
namespace {

class ExemplarColor : public SurfaceColor {
 public:
  ExemplarColor(const ExemplarPhoto& photo, const Lighting& lighting)
      : lighting_(lighting), mm_per_pixel_(photo.mm_per_pixel), texture_(Exemplar(photo)) {}

  // A photograph is smooth over its own pixels' pairs.
  double detail_mm() const override { return 4 * mm_per_pixel_; }
  const Exemplar& exemplar() const { return texture_.exemplar(); }

  void shade(const std::vector<Eigen::Vector3d>& points,
             const std::vector<Eigen::Vector3d>& normals, const std::vector<RayHit>&,
             std::vector<Eigen::Vector3f>& colors) const override {
    colors.resize(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      colors[i] = texture_.at(points[i], normals[i])
                      .cwiseProduct(lighting_.diffuse(normals[i]).cast<float>());
  }

 private:
  Lighting lighting_;
  double mm_per_pixel_;
  ExemplarTexture texture_;
};

}  // namespace

ExemplarLook make_exemplar_color(const ExemplarPhoto& photo, Material material) {
  material.check();
  if (material.tissue == Tissue::plain) material.tissue = Tissue::liver;
  const Lighting lighting = material.lighting();
  auto color = std::make_unique<ExemplarColor>(photo, lighting);
  const double highlights = color->exemplar().highlight_share();
  const std::size_t tissue = color->exemplar().tissue().size();
  return {std::move(color), lighting, highlights, tissue};
}

}  // namespace organbake
