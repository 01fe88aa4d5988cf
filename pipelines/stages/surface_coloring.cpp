// SPDX-License-Identifier: GPL-3.0-or-later
#include "pipelines/stages/surface_coloring.h"

namespace organbake {

SurfaceColoring choose_coloring(const TriangleMesh& surface, const RayScene& scene,
                                std::vector<Photo> photos, const Material& material,
                                const std::optional<Lighting>& lighting, StageReport& report) {
  report.add("photos", photos.size());
  if (!photos.empty()) {
    report.add("color", "photos");
    report.skipped.push_back({"the material", "there are photographs"});
    return {make_photo_color(surface, scene, std::move(photos)), lighting};
  }
  report.skipped.push_back({"colour from photographs", "none are given"});
  if (!surface.colors.empty()) {
    report.add("color", "vertices");
    report.skipped.push_back({"the material", "the surface has colours of its own"});
    return {make_vertex_color(surface), lighting};
  }
  report.add("color", "material");
  report.skipped.push_back({"colour from vertices", "the surface has none"});
  if (lighting) report.skipped.push_back({"the lighting", "a material brings its own"});
  return {make_material_color(material), material.lighting()};
}

}  // namespace organbake
