// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "measuring/measurement.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"

namespace organbake {

// A point of a COLMAP model's points3D.txt.
struct ModelPoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  double error_px = 0;           // mean reprojection error
  std::size_t sightings = 0;     // frames that see it
  double largest_angle_deg = 0;  // between two of them; 0 where the model has no tracks
};

// From a folder with cameras.txt (one lens), images.txt and points3D.txt. Where points have tracks,
// their errors are measured anew. Throws NoInputError, BadDataError.
std::vector<ModelPoint> read_model_points(const std::filesystem::path& model);

// How well a model's points are held: those of at least three frames and more than 2 degrees.
struct ModelQuality {
  std::size_t points = 0;
  double reprojection_px = 0;  // mean over their sightings
};
ModelQuality quality_of(const std::vector<ModelPoint>& points);

// Debian's colmap on frames that lie as PNG files in a folder, with masks (NAME.png.png, black =
// ignored) in another: features, sequential pairs, mapper, one SIMPLE_RADIAL lens for all, without
// a GPU.
struct ColmapRun {
  std::filesystem::path frames, masks, work;
  std::optional<Intrinsics> lens;  // given and kept; else found
  std::filesystem::path database() const { return work / "database.db"; }
};
struct ColmapResult {
  CameraSet cameras;
  std::vector<ModelPoint> points;
  Timing timing;  // of all three steps
};
bool has_colmap();
// Nothing when its mapper makes no model. Throws what run_worker does.
std::optional<ColmapResult> run_colmap(const ColmapRun& run, const RunContext& context);

}  // namespace organbake
