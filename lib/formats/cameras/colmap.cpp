// SPDX-License-Identifier: GPL-3.0-or-later
// COLMAP's own files, as text and binary (its documentation, "Output Format"): lenses, images with
// their poses, and since COLMAP 3.12 rigs and frames, which say where an image was taken from.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "cameras/camera_formats.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// One of COLMAP's models of lenses that are pinholes with k1 k2 p1 p2 k3 at most, or fisheyes with
// k1 k2 k3 k4.
struct ColmapModel {
  int number = 0;  // in COLMAP's binary files
  std::string name;
  std::vector<std::string> parameters;  // in COLMAP's order; 'f' is both focal lengths
  LensModel model = LensModel::brown;
};

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

// Null for a model that is not read.
template <class Value>
const ColmapModel* model_with(Value ColmapModel::*member, const Value& value) {
  const auto found = std::ranges::find(models(), value, member);
  return found == models().end() ? nullptr : &*found;
}

// "SIMPLE_PINHOLE, PINHOLE, …", for messages.
std::string colmap_model_names() {
  return joined(models(), ", ", [](const ColmapModel& model) { return model.name; });
}

// `values` are as many as the model's parameters. Throws BadDataError naming `path` where one that
// has no place here is not 0, or is no finite number.
Intrinsics colmap_lens(const ColmapModel& model, const std::vector<double>& values,
                       const fs::path& path) {
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

// Of a quaternion (w, x, y, z) and a translation; nothing for what is no pose.
std::optional<RigidTransform> pose_of(const double (&numbers)[7]) {
  const Eigen::Quaterniond q(numbers[0], numbers[1], numbers[2], numbers[3]);
  const Eigen::Vector3d translation(numbers[4], numbers[5], numbers[6]);
  if (!(q.norm() > 0) || !q.coeffs().allFinite() || !translation.allFinite()) return std::nullopt;
  return RigidTransform{q.normalized().toRotationMatrix(), translation};
}

// An image as its texts and its binary files have it, with its pose from world to camera. Throws
// BadDataError naming `path` for what is no pose, and for a name that is no UTF-8.
void add_colmap_image(const double (&pose)[7], const Intrinsics& lens, const std::string& name,
                      long id, const fs::path& path, CameraSet& set) {
  const auto camera_from_world = pose_of(pose);
  if (!camera_from_world || name.empty())
    throw BadDataError(path, "image " + std::to_string(id) + " has no sound pose or no name");
  // Names go on into documents that hold nothing but UTF-8.
  try {
    nlohmann::json(name).dump();
  } catch (const nlohmann::json::exception&) {
    throw BadDataError(path, "the name of image " + std::to_string(id) +
                                 " is no UTF-8 text: rename the image, here and in its folder");
  }
  set.images.push_back(name);
  set.cameras.push_back({name, lens, *camera_from_world});
}

std::vector<std::string> lines_of(const fs::path& path) {
  std::istringstream text(read_text_file(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() != '#') lines.push_back(line);
  }
  return lines;
}

std::map<long, Intrinsics> read_lenses(const fs::path& path) {
  std::map<long, Intrinsics> lenses;
  for (const std::string& line : lines_of(path)) {
    if (line.empty()) continue;
    std::istringstream words(line);
    long id = 0;
    int width = 0, height = 0;
    std::string name;
    words >> id >> name >> width >> height;
    const ColmapModel* model = model_with(&ColmapModel::name, name);
    if (!words || !model)
      throw BadDataError(
          path, "'" + line + "' is no camera of a model that is read: " + colmap_model_names());
    std::vector<double> values;
    for (const std::string& parameter : model->parameters) {
      double value = 0;
      if (!(words >> value)) throw BadDataError(path, "'" + line + "' lacks its " + parameter);
      values.push_back(value);
    }
    if (std::string more; words >> more)
      throw BadDataError(path, "'" + line + "' has more than the " +
                                   std::to_string(model->parameters.size()) + " numbers of " +
                                   name);
    lenses[id] = colmap_lens(*model, values, path);
    lenses[id].width = width;
    lenses[id].height = height;
  }
  return lenses;
}

std::map<std::uint32_t, Intrinsics> binary_lenses(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  PackedReader reader(bytes, path.string());
  std::map<std::uint32_t, Intrinsics> lenses;
  for (auto left = reader.next<std::uint64_t>(); left > 0; --left) {
    const auto id = reader.next<std::uint32_t>();
    const auto number = reader.next<std::int32_t>();
    const auto width = reader.next<std::uint64_t>(), height = reader.next<std::uint64_t>();
    const ColmapModel* model = model_with(&ColmapModel::number, number);
    if (!model)
      reader.fail("camera " + std::to_string(id) + " is of COLMAP's model number " +
                  std::to_string(number) + "; read are " + colmap_model_names());
    std::vector<double> values;
    for (std::size_t i = 0; i < model->parameters.size(); ++i)
      values.push_back(reader.next<double>());
    Intrinsics lens = colmap_lens(*model, values, path);
    lens.width = written_size(static_cast<double>(width));
    lens.height = written_size(static_cast<double>(height));
    lenses[id] = lens;
  }
  reader.end();
  return lenses;
}

std::string next_name(PackedReader& reader) {
  std::string name;
  for (char c; (c = reader.next<char>()) != '\0';) name += c;
  return name;
}

// Where the cameras of a rig are in it, and where the rig was for the images of each frame. A
// sensor that is no camera has no images.
using CamerasOfRig = std::map<std::uint64_t, RigidTransform>;  // camera_from_rig
struct ColmapFrames {
  std::map<std::uint64_t, CamerasOfRig> rigs;
  std::map<std::uint64_t, RigidTransform> camera_from_world;  // of each image

  void add(std::uint64_t image, std::uint64_t camera, std::uint64_t rig,
           const RigidTransform& rig_from_world, const fs::path& path) {
    const auto cameras = rigs.find(rig);
    if (cameras == rigs.end() || !cameras->second.contains(camera))
      throw BadDataError(path, "rig " + std::to_string(rig) + " does not say where its camera " +
                                   std::to_string(camera) + " is");
    camera_from_world[image] = cameras->second.at(camera) * rig_from_world;
  }
};

// Of a line of text, or of what follows in a binary file.
class TextNumbers {
 public:
  TextNumbers(const std::string& line, const fs::path& path)
      : line_(line), words_(line), path_(path) {}

  std::uint64_t number() { return next<std::uint64_t>(); }
  std::uint64_t image() { return number(); }
  double real() { return next<double>(); }
  bool flag() { return number() != 0; }
  bool is_camera() { return next<std::string>() == "CAMERA"; }
  const fs::path& path() const { return path_; }

 private:
  template <class Value>
  Value next() {
    Value value{};
    if (!(words_ >> value)) throw BadDataError(path_, "'" + line_ + "' ends early");
    return value;
  }
  const std::string& line_;
  std::istringstream words_;
  const fs::path& path_;
};

class BinaryNumbers {
 public:
  BinaryNumbers(PackedReader& reader, const fs::path& path) : reader_(reader), path_(path) {}

  std::uint64_t number() { return reader_.next<std::uint32_t>(); }
  std::uint64_t image() { return reader_.next<std::uint64_t>(); }
  double real() { return reader_.next<double>(); }
  bool flag() { return reader_.next<std::uint8_t>() != 0; }
  bool is_camera() { return reader_.next<std::int32_t>() == 0; }
  const fs::path& path() const { return path_; }

 private:
  PackedReader& reader_;
  const fs::path& path_;
};

template <class Numbers>
RigidTransform next_pose(Numbers& from) {
  double values[7];  // quaternion w x y z, translation
  for (double& value : values) value = from.real();
  const auto pose = pose_of(values);
  if (!pose) throw BadDataError(from.path(), "holds a pose that is none");
  return *pose;
}

template <class Numbers>
void add_rig(Numbers& from, ColmapFrames& frames) {
  CamerasOfRig& cameras = frames.rigs[from.number()];
  const std::uint64_t sensors = from.number();
  for (std::uint64_t s = 0; s < sensors; ++s) {
    const bool is_camera = from.is_camera();
    const std::uint64_t id = from.number();
    const bool first = s == 0;  // the others are placed by it
    if (!first && !from.flag()) continue;
    const RigidTransform pose = first ? RigidTransform() : next_pose(from);
    if (is_camera) cameras[id] = pose;
  }
}

template <class Numbers>
void add_frame(Numbers& from, ColmapFrames& frames) {
  from.number();  // its own
  const std::uint64_t rig = from.number();
  const RigidTransform rig_from_world = next_pose(from);
  const std::uint64_t images = from.number();
  for (std::uint64_t i = 0; i < images; ++i) {
    const bool is_camera = from.is_camera();
    const std::uint64_t camera = from.number(), image = from.image();
    if (is_camera) frames.add(image, camera, rig, rig_from_world, from.path());
  }
}

// Calls add(numbers) for each entry of a file.
template <class Add>
void for_each_entry(const fs::path& path, const Add& add) {
  if (path.extension() == ".txt") {
    for (const std::string& line : lines_of(path)) {
      if (line.empty()) continue;
      TextNumbers numbers(line, path);
      add(numbers);
    }
    return;
  }
  const std::vector<std::byte> bytes = read_file(path);
  PackedReader reader(bytes, path.string());
  BinaryNumbers numbers(reader, path);
  for (auto left = reader.next<std::uint64_t>(); left > 0; --left) add(numbers);
  reader.end();
}

// Nothing for a model without rigs and frames: before COLMAP 3.12, or with files of both that are
// empty.
std::optional<ColmapFrames> read_frames(const fs::path& folder, const std::string& ending) {
  const fs::path rigs = folder / ("rigs" + ending), poses = folder / ("frames" + ending);
  if (!fs::exists(rigs) || !fs::exists(poses)) return std::nullopt;
  ColmapFrames frames;
  for_each_entry(rigs, [&](auto& numbers) { add_rig(numbers, frames); });
  for_each_entry(poses, [&](auto& numbers) { add_frame(numbers, frames); });
  if (frames.rigs.empty() && frames.camera_from_world.empty()) return std::nullopt;
  return frames;
}

// COLMAP itself takes poses from the frames and passes over those beside the images, which other
// programs leave as they were when they change frames or rigs.
void place_by_frames(const fs::path& path, const std::vector<std::uint64_t>& ids,
                     const ColmapFrames& frames, CameraSet& set, const RunContext& context) {
  constexpr double kRounding = 1e-6;  // rad, and of a translation's length
  double most_rad = 0, most_mm = 0;
  std::size_t stale = 0;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto found = frames.camera_from_world.find(ids[i]);
    if (found == frames.camera_from_world.end())
      throw BadDataError(path, "image " + std::to_string(ids[i]) + " stands in no frame of frames" +
                                   path.extension().string());
    RigidTransform& written = set.cameras[i].camera_from_world;
    const RigidTransform between = found->second * written.inverse();
    const double turn_rad = Eigen::AngleAxisd(between.rotation).angle();
    const double apart_mm =
        (found->second.inverse().translation - written.inverse().translation).norm();
    if (turn_rad > kRounding || apart_mm > kRounding * (1 + written.translation.norm())) {
      ++stale;
      most_rad = std::max(most_rad, turn_rad);
      most_mm = std::max(most_mm, apart_mm);
    }
    written = found->second;
  }
  if (stale == 0) return;
  context.warn(path.string() + ": the poses of " + std::to_string(stale) + " of its " +
               std::to_string(ids.size()) +
               " images differ from those of the frames and rigs, by " + to_text(most_mm, 3) +
               " mm and " + to_text(most_rad * 180 / M_PI, 3) +
               "° at the most; the frames' are taken, as COLMAP does");
}

void skip_points(PackedReader& reader) {
  constexpr std::size_t kPointBytes = 24;  // x, y, and which point in space it shows
  const auto points = reader.next<std::uint64_t>();
  if (points > SIZE_MAX / kPointBytes) reader.fail("ends early");
  reader.take(static_cast<std::size_t>(points) * kPointBytes);
}

}  // namespace

CameraSet read_colmap_text(const fs::path& folder, const RunContext& context) {
  const std::map<long, Intrinsics> lenses = read_lenses(folder / "cameras.txt");
  const fs::path path = folder / "images.txt";
  const std::vector<std::string> lines = lines_of(path);
  CameraSet set;
  std::vector<std::uint64_t> ids;
  // Every second line holds points; an image without any has an empty one.
  for (std::size_t i = 0; i < lines.size(); i += 2) {
    if (lines[i].empty()) continue;
    std::istringstream words(lines[i]);
    long id = 0, lens = 0;
    double pose[7];
    words >> id;
    for (double& number : pose) words >> number;
    words >> lens;
    // The rest of the line, as COLMAP has it: a name may hold spaces.
    std::string name;
    std::getline(words >> std::ws, name);
    if (!words || !lenses.contains(lens))
      throw BadDataError(path, "'" + lines[i] + "' is no image with a pose and a known camera");
    add_colmap_image(pose, lenses.at(lens), name, id, path, set);
    ids.push_back(static_cast<std::uint64_t>(id));
  }
  if (const auto frames = read_frames(folder, ".txt"))
    place_by_frames(path, ids, *frames, set, context);
  return set;
}

CameraSet read_colmap_binary(const fs::path& folder, const RunContext& context) {
  const std::map<std::uint32_t, Intrinsics> lenses = binary_lenses(folder / "cameras.bin");
  const fs::path path = folder / "images.bin";
  const std::vector<std::byte> bytes = read_file(path);
  PackedReader reader(bytes, path.string());
  CameraSet set;
  std::vector<std::uint64_t> ids;
  for (auto left = reader.next<std::uint64_t>(); left > 0; --left) {
    const auto id = reader.next<std::uint32_t>();
    double pose[7];  // quaternion w x y z, translation
    for (double& number : pose) number = reader.next<double>();
    const auto lens = lenses.find(reader.next<std::uint32_t>());
    const std::string name = next_name(reader);
    skip_points(reader);
    if (lens == lenses.end())
      reader.fail("image " + std::to_string(id) + " is of a camera that cameras.bin has not");
    add_colmap_image(pose, lens->second, name, id, path, set);
    ids.push_back(id);
  }
  reader.end();
  if (const auto frames = read_frames(folder, ".bin"))
    place_by_frames(path, ids, *frames, set, context);
  return set;
}

}  // namespace organbake
