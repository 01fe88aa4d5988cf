// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/cameras_json.h"

namespace organbake {

// One of COLMAP's models of lenses that are pinholes with k1 k2 p1 p2 k3 at most, or fisheyes with
// k1 k2 k3 k4.
struct ColmapModel {
  int number = 0;  // in COLMAP's binary files
  std::string name;
  std::vector<std::string> parameters;  // in COLMAP's order; 'f' is both focal lengths
  LensModel model = LensModel::brown;
};

// Null for a model that is not read.
const ColmapModel* colmap_lens_model(const std::string& name);
const ColmapModel* colmap_lens_model(int number);

// "SIMPLE_PINHOLE, PINHOLE, …", for messages.
std::string colmap_model_names();

// `values` are as many as the model's parameters. Throws BadDataError naming `path` where one that
// has no place here is not 0, or is no finite number.
Intrinsics colmap_lens(const ColmapModel& model, const std::vector<double>& values,
                       const std::filesystem::path& path);

// An image as its texts and its binary files have it: a quaternion (w, x, y, z) and a translation
// from world to camera. Throws BadDataError naming `path` for what is no pose, and for a name that
// is no UTF-8.
void add_colmap_image(const double (&pose)[7], const Intrinsics& lens, const std::string& name,
                      long id, const std::filesystem::path& path, CameraSet& set);

}  // namespace organbake
