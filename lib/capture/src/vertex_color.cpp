// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/capture/surface_color.h"
#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"

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

}  // namespace

std::unique_ptr<SurfaceColor> make_vertex_color(const TriangleMesh& surface) {
  check_mesh(surface, "surface");
  if (surface.colors.empty())
    throw BadDataError("surface: it has no vertex colours; give photos or a material instead");
  for (const Eigen::Vector3f& color : surface.colors)
    if (!color.allFinite()) throw BadDataError("surface: a vertex colour is not a finite number");
  return std::make_unique<VertexColor>(surface);
}

}  // namespace organbake
