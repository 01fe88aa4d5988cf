// SPDX-License-Identifier: GPL-3.0-or-later
#include "cameras/colmap_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"

namespace organbake {
namespace {

const std::vector<ColmapModel>& models() {
  static const std::vector<ColmapModel> models = {
      {0, "SIMPLE_PINHOLE", {"f", "cx", "cy"}},
      {1, "PINHOLE", {"fx", "fy", "cx", "cy"}},
      {2, "SIMPLE_RADIAL", {"f", "cx", "cy", "k1"}},
      {3, "RADIAL", {"f", "cx", "cy", "k1", "k2"}},
      {4, "OPENCV", {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"}},
      {6, "FULL_OPENCV", {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}},
      {5, "OPENCV_FISHEYE", {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"}, LensModel::fisheye},
      {8, "SIMPLE_RADIAL_FISHEYE", {"f", "cx", "cy", "k1"}, LensModel::fisheye},
      {9, "RADIAL_FISHEYE", {"f", "cx", "cy", "k1", "k2"}, LensModel::fisheye}};
  return models;
}

template <class Matches>
const ColmapModel* first_that(const Matches& matches) {
  const auto found = std::find_if(models().begin(), models().end(), matches);
  return found == models().end() ? nullptr : &*found;
}

}  // namespace

const ColmapModel* colmap_lens_model(const std::string& name) {
  return first_that([&](const ColmapModel& model) { return model.name == name; });
}

const ColmapModel* colmap_lens_model(int number) {
  return first_that([&](const ColmapModel& model) { return model.number == number; });
}

std::string colmap_model_names() {
  std::string names;
  for (const ColmapModel& model : models()) names += (names.empty() ? "" : ", ") + model.name;
  return names;
}

Intrinsics colmap_lens(const ColmapModel& model, const std::vector<double>& values,
                       const std::filesystem::path& path) {
  Intrinsics k;
  k.model = model.model;
  std::map<std::string, double*> places = {{"fx", &k.fx}, {"fy", &k.fy}, {"cx", &k.cx},
                                           {"cy", &k.cy}, {"k1", &k.k1}, {"k2", &k.k2},
                                           {"p1", &k.p1}, {"p2", &k.p2}, {"k3", &k.k3}};
  if (k.model == LensModel::fisheye) places["k4"] = &k.k4;
  for (std::size_t i = 0; i < model.parameters.size(); ++i) {
    const std::string& name = model.parameters[i];
    if (!std::isfinite(values[i])) throw BadDataError(path, "its " + name + " is no finite number");
    if (name == "f") {
      k.fx = k.fy = values[i];
    } else if (places.contains(name)) {
      *places.at(name) = values[i];
    } else if (values[i] != 0) {
      throw BadDataError(path, "its distortion " + name + " is not supported");
    }
  }
  return k;
}

void add_colmap_image(const double (&pose)[7], const Intrinsics& lens, const std::string& name,
                      long id, const std::filesystem::path& path, CameraSet& set) {
  const Eigen::Quaterniond q(pose[0], pose[1], pose[2], pose[3]);
  const Eigen::Vector3d translation(pose[4], pose[5], pose[6]);
  if (!(q.norm() > 0) || !q.coeffs().allFinite() || !translation.allFinite() || name.empty())
    throw BadDataError(path, "image " + std::to_string(id) + " has no sound pose or no name");
  // Names go on into documents that hold nothing but UTF-8.
  try {
    nlohmann::json(name).dump();
  } catch (const nlohmann::json::exception&) {
    throw BadDataError(path, "the name of image " + std::to_string(id) +
                                 " is no UTF-8 text: rename the image, here and in its folder");
  }
  set.images.push_back(name);
  set.cameras.push_back({name, lens, {q.normalized().toRotationMatrix(), translation}});
}

}  // namespace organbake
