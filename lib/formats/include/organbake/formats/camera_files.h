// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Posed cameras as other programs keep them, in our conventions (camera_from_world, mm, OpenCV
// axes, first pixel's centre at (0.5, 0.5)). Told apart by content: our cameras.json or pose.json;
// a transforms.json (NeRF: camera to world, OpenGL axes); a COLMAP model, text or binary (its
// folder, the folder with its sparse/0, or its file of cameras or of images; lenses SIMPLE_PINHOLE,
// PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV without k4…k6, OPENCV_FISHEYE and its simpler
// ones; where it has rigs and frames, their poses, and it is warned of images' own that differ; of
// a folder with both, the binary model). Lengths are taken as millimetres. Throws NoInputError,
// BadDataError.
CameraSet read_camera_file(const std::filesystem::path& path, const RunContext& context = {});

// Whether it is named as one of COLMAP's files of cameras or of images, or is a folder that holds
// one of cameras.
bool is_colmap_model(const std::filesystem::path& path);

// The camera whose image has this file name, wherever it lies.
std::optional<std::size_t> camera_with_image(const CameraSet& set, const std::string& image);

// The lens alone: an OpenCV calibration (YAML, JSON or XML: camera_matrix, distortion_coefficients,
// and image_width and image_height unless width and height below say them), one of those of
// lens_files.h, SCARED's frame_data.json, a JSON object with width, height, fx, fy, cx, cy and
// perhaps distortion_k1_k2_p1_p2_k3, or any of the above: of the camera with this image, or of the
// first. OpenCV counts from the first pixel's centre, we from its corner: half a pixel is added to
// its cx and cy. width and height are the photograph's.
Intrinsics read_intrinsics(const std::filesystem::path& path, const std::string& image, int width,
                           int height);

// A point of the surface, and where the images show it (each image at most once).
struct SparsePoint {
  struct Sighting {
    std::uint32_t image = 0;  // of the set
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  };
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> srgb{};
  std::vector<Sighting> seen;
};

// The texts of a COLMAP model's three files.
std::string colmap_cameras_text(const CameraSet& set);
std::string colmap_images_text(const CameraSet& set, const std::vector<SparsePoint>& points = {});
std::string colmap_points_text(const std::vector<SparsePoint>& points = {});

// What trainers of radiance fields and splats ask for beside the poses.
struct SceneFacts {
  Bounds bounds_mm;                 // of the organ
  double depth_unit_mm = 0;         // of a count in the depth pictures; 0 = there are none
  std::vector<std::string> depths;  // one file per camera
  std::string points;               // a PLY file of points with colours
};
// In millimetres, LPS. With facts: the keys of instant-ngp (scale, offset and aabb_scale put the
// organ into its unit cube; integer_depth_scale, depth_path) and of nerfstudio (depth_file_path,
// ply_file_path), and bounds and units in words of our own.
std::string transforms_json(const CameraSet& set, const SceneFacts& facts = {});
// The same facts for those who read a COLMAP model.
std::string scene_json(const SceneFacts& facts);
// A binary PLY of places (float) and colours (uchar).
std::string point_cloud_ply(const std::vector<SparsePoint>& points);

}  // namespace organbake
