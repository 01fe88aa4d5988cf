// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "bundle/cameras_json.h"

namespace organbake {

// Posed cameras as other programs keep them, in our conventions (camera_from_world, mm, OpenCV
// axes, first pixel's centre at (0.5, 0.5)). Told apart by content: our cameras.json or pose.json;
// a transforms.json (NeRF: camera to world, OpenGL axes); a COLMAP text model (its folder, or
// cameras.txt or images.txt in it; models SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV,
// FULL_OPENCV without k4…k6). Lengths are taken as millimetres. Throws NoInputError, BadDataError.
CameraSet read_camera_file(const std::filesystem::path& path);

// The camera whose image has this file name, wherever it lies.
std::optional<std::size_t> camera_with_image(const CameraSet& set, const std::string& image);

// The lens alone: an OpenCV calibration (YAML: camera_matrix, distortion_coefficients, and
// image_width and image_height unless width and height below say them), a JSON object with width,
// height, fx, fy, cx, cy and perhaps distortion_k1_k2_p1_p2_k3, or any of the above: of the camera
// with this image, or of the first. OpenCV counts from the first pixel's centre, we from its
// corner: half a pixel is added to its cx and cy. width and height are the photograph's.
Intrinsics read_intrinsics(const std::filesystem::path& path, const std::string& image, int width,
                           int height);

// The texts of a COLMAP model's three files.
std::string colmap_cameras_text(const CameraSet& set);
std::string colmap_images_text(const CameraSet& set);
std::string colmap_points_text();
std::string transforms_json(const CameraSet& set);

}  // namespace organbake
