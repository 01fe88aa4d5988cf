// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/capture/surface_coloring.h"

namespace organbake {

SurfaceColoring choose_coloring(const TracedSurface& surface, std::vector<Photo> photos,
                                const std::optional<ExemplarPhoto>& exemplar,
                                const Material& material, const std::optional<Lighting>& lighting,
                                StageReport& report) {
  report.add("photos", photos.size());
  if (!photos.empty()) {
    report.add("color", "photos");
    report.skipped.push_back({"the material", "there are photographs"});
    if (exemplar) report.skipped.push_back({"the exemplar", "there are photographs"});
    return {make_photo_color(surface, std::move(photos)), lighting};
  }
  report.skipped.push_back({"colour from photographs", "none are given"});
  if (!surface.mesh.colors.empty()) {
    report.add("color", "vertices");
    report.skipped.push_back({"the material", "the surface has colours of its own"});
    if (exemplar) report.skipped.push_back({"the exemplar", "the surface has colours of its own"});
    return {make_vertex_color(surface.mesh), lighting};
  }
  report.skipped.push_back({"colour from vertices", "the surface has none"});
  if (lighting) report.skipped.push_back({"the lighting", "a material brings its own"});
  if (exemplar) {
    ExemplarLook look = make_exemplar_color(*exemplar, material);
    report.add("color", "exemplar");
    report.add("exemplar_tissue_px", look.tissue_px);
    report.add("exemplar_highlight_share", look.highlight_share);
    return {std::move(look.color), look.lighting};
  }
  report.add("color", "material");
  return {make_material_color(material), material.lighting()};
}

}  // namespace organbake
