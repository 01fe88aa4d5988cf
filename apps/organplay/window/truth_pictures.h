// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "organbake/player/carried_surface.h"
#include "organbake/player/player.h"

namespace organbake {

// What the frame is held against.
enum class Against { nothing, truth, polygons, difference };

// Pictures of the bundle's true surface for the view and the deformation of a frame. They take a
// second or so, and are kept until either changes.
class TruthPictures {
 public:
  // Nothing can be shown when the bundle carries no surface; that is no error.
  TruthPictures(const std::filesystem::path& bundle_folder, ShellSurface shell);

  bool available() const { return available_; }
  // truth: the carried surface. polygons: the same picture painted flat onto the faces of
  // the shell's surface.
  // difference: |frame − truth| times four.
  const Rgb8Image& picture(Against against, const std::vector<Eigen::Vector3d>& positions,
                           const View& view, const Frame& frame, const DrawOptions& options);

 private:
  const CarriedSurface& surface();
  std::vector<Eigen::Vector3d> flattened(const std::vector<Eigen::Vector3d>& positions);

  std::filesystem::path bundle_folder_;
  ShellSurface shell_;
  bool available_;
  std::unique_ptr<CarriedSurface> surface_;  // read when it is first asked for
  Against kept_against_ = Against::nothing;
  View kept_view_;
  std::vector<Eigen::Vector3d> kept_positions_;
  Rgb8Image kept_;
};

}  // namespace organbake
