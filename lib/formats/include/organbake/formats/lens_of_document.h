// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>

#include "organbake/formats/named_matrices.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {

enum class EndoscopeEye { left, right };

// The lens of an eye in a calibration that keeps each camera as a part of its own; nothing where it
// does not:
// - Kalibr's camchain (cam0, cam1: intrinsics, distortion_coeffs, resolution),
// - StereoMIS's StereoCalibration.ini ([StereoLeft], [StereoRight]: fc_x, cc_x, kc_0 …),
// - MATLAB's cameraParameters and stereoParameters as jsonencode(toStruct(…)) writes them, whose
//   pixels are counted from 1.
// `width` and `height` are the pictures', for a document that does not tell them. Throws
// BadDataError.
std::optional<Intrinsics> lens_of_parts(const NamedMatrices& found, EndoscopeEye eye, int width,
                                        int height, const std::filesystem::path& path);

// How the right eye stands to the left one, in the document's unit, and how many millimetres that
// is where its program knows one alone (Kalibr: metres). Nothing where the parts do not tell.
struct PoseOfParts {
  RigidTransform right_from_left;
  std::optional<double> mm_per_unit;
};
std::optional<PoseOfParts> pose_of_parts(const NamedMatrices& found,
                                         const std::filesystem::path& path);

// The part that holds the matrices themselves: SCARED's frame_data.json has them under
// "camera-calibration"; else the whole.
const NamedMatrices& matrices_of(const NamedMatrices& found);

// The lens of a matrix of 3×3 and, if given, k1 k2 p1 p2 k3, or k1 k2 k3 k4 where the document's
// words name a fisheye's model (equidistant, Kannala–Brandt). Throws BadDataError for another
// model, where more of a distortion than that is not 0, for a count of numbers that no distortion
// has, for one that is no number, and for a matrix of another form.
Intrinsics lens_of_matrices(const NamedMatrices& found, const NamedMatrices::Matrix& k,
                            const NamedMatrices::Matrix* d, Intrinsics sized,
                            const std::filesystem::path& path);

}  // namespace organbake
