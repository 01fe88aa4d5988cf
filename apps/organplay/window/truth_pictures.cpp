// SPDX-License-Identifier: Apache-2.0
#include "window/truth_pictures.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "organbake/bundle/bundle_reader.h"

namespace organbake {

TruthPictures::TruthPictures(const std::filesystem::path& bundle_folder, ShellSurface shell)
    : bundle_folder_(bundle_folder),
      shell_(std::move(shell)),
      available_(BundleReader(bundle_folder).has("surface.ply")) {}

const CarriedSurface& TruthPictures::surface() {
  if (!surface_) {
    surface_ =
        std::make_unique<CarriedSurface>(BundleReader(bundle_folder_).read_surface(), shell_);
  }
  return *surface_;
}

// Every point of the surface at its foot on the shell's surface: a polygon's texture.
std::vector<Eigen::Vector3d> TruthPictures::flattened(
    const std::vector<Eigen::Vector3d>& positions) {
  const TriangleMesh posed = shell_.posed(positions);
  std::vector<Eigen::Vector3d> flat;
  flat.reserve(surface().bindings().size());
  for (const ShellBinding& binding : surface().bindings()) {
    const auto& [a, b, c] = posed.faces[binding.face];
    const auto& v = posed.vertices;
    flat.push_back((1 - binding.b1 - binding.b2) * v[a] + binding.b1 * v[b] + binding.b2 * v[c]);
  }
  return flat;
}

const Rgb8Image& TruthPictures::picture(Against against,
                                        const std::vector<Eigen::Vector3d>& positions,
                                        const View& view, const Frame& frame,
                                        const DrawOptions& options) {
  if (against == kept_against_ && view == kept_view_ && positions == kept_positions_) return kept_;
  const std::vector<Eigen::Vector3d> vertices =
      against == Against::polygons ? flattened(positions) : surface().carry(positions);
  kept_ = surface().draw(vertices, view, options.background).color;
  if (against == Against::difference) {
    constexpr int kGain = 4;
    for (std::size_t i = 0; i < kept_.pixels.size(); ++i) {
      const int off = std::abs(int(kept_.pixels[i]) - int(frame.color.pixels[i]));
      kept_.pixels[i] = static_cast<std::uint8_t>(std::min(255, kGain * off));
    }
  }
  kept_against_ = against;
  kept_view_ = view;
  kept_positions_ = positions;
  return kept_;
}

}  // namespace organbake
