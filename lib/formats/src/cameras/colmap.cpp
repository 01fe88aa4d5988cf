// SPDX-License-Identifier: GPL-3.0-or-later
// COLMAP's own files, cameras.bin and images.bin (its documentation, "Output Format").
#include "cameras/colmap.h"

#include <Eigen/Geometry>
#include <map>
#include <sstream>

#include "cameras/colmap_parts.h"
#include "organbake/bundle/packed_bytes.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/formats/camera_files.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> lines_of(const fs::path& path) {
  std::istringstream text(read_text_file(path));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() != '#') lines.push_back(line);
  }
  return lines;
}

std::string lacking(const std::string& line, const std::string& parameter) {
  return "'" + line + "' lacks its " + parameter;
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
    const ColmapModel* model = colmap_lens_model(name);
    if (!words || !model) {
      throw BadDataError(
          path, "'" + line + "' is no camera of a model that is read: " + colmap_model_names());
    }
    std::vector<double> values;
    for (const std::string& parameter : model->parameters) {
      double value = 0;
      if (!(words >> value)) throw BadDataError(path, lacking(line, parameter));
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

constexpr int kPlaceDigits = 5, kPixelDigits = 3;

// For each image its X, Y, POINT3D_ID triples, in the order of the points.
std::vector<std::string> sighting_lines(std::size_t images,
                                        const std::vector<SparsePoint>& points) {
  std::vector<std::string> lines(images);
  for (std::size_t p = 0; p < points.size(); ++p) {
    for (const SparsePoint::Sighting& seen : points[p].seen) {
      std::string& line = lines.at(seen.image);
      if (!line.empty()) line += " ";
      line += to_text(seen.pixel.x(), kPixelDigits) + " " + to_text(seen.pixel.y(), kPixelDigits) +
              " " + std::to_string(p + 1);
    }
  }
  return lines;
}

std::map<std::uint32_t, Intrinsics> binary_lenses(const fs::path& path) {
  const std::vector<std::byte> bytes = read_file(path);
  PackedReader reader(bytes, path.string());
  std::map<std::uint32_t, Intrinsics> lenses;
  for (auto left = reader.next<std::uint64_t>(); left > 0; --left) {
    const auto id = reader.next<std::uint32_t>();
    const auto number = reader.next<std::int32_t>();
    const auto width = reader.next<std::uint64_t>(), height = reader.next<std::uint64_t>();
    const ColmapModel* model = colmap_lens_model(number);
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

void skip_points(PackedReader& reader) {
  constexpr std::size_t kPointBytes = 24;  // x, y, and which point in space it shows
  const auto points = reader.next<std::uint64_t>();
  if (points > SIZE_MAX / kPointBytes) reader.fail("ends early");
  reader.take(static_cast<std::size_t>(points) * kPointBytes);
}

}  // namespace

CameraSet read_colmap_text(const fs::path& folder) {
  const std::map<long, Intrinsics> lenses = read_lenses(folder / "cameras.txt");
  const fs::path path = folder / "images.txt";
  const std::vector<std::string> lines = lines_of(path);
  CameraSet set;
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
    if (!words || !lenses.contains(lens)) {
      throw BadDataError(path, "'" + lines[i] + "' is no image with a pose and a known camera");
    }
    add_colmap_image(pose, lenses.at(lens), name, id, path, set);
  }
  return set;
}

std::string colmap_cameras_text(const CameraSet& set) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const Intrinsics& k = set.cameras[i].intrinsics;
    std::vector<double> values = {k.fx, k.fy, k.cx, k.cy};
    const char* model = " PINHOLE ";
    if (k.model == LensModel::fisheye) {
      model = " OPENCV_FISHEYE ";
      values.insert(values.end(), {k.k1, k.k2, k.k3, k.k4});
    } else if (k.has_distortion()) {
      model = " FULL_OPENCV ";
      values.insert(values.end(), {k.k1, k.k2, k.p1, k.p2, k.k3, 0, 0, 0});
    }
    text +=
        std::to_string(i + 1) + model + std::to_string(k.width) + " " + std::to_string(k.height);
    for (const double value : values) text += " " + to_text(value);
    text += "\n";
  }
  return text;
}

std::string colmap_images_text(const CameraSet& set, const std::vector<SparsePoint>& points) {
  const std::vector<std::string> sightings = sighting_lines(set.cameras.size(), points);
  std::string text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME, then its points\n";
  for (std::size_t i = 0; i < set.cameras.size(); ++i) {
    const RigidTransform& pose = set.cameras[i].camera_from_world;
    const Eigen::Quaterniond q(pose.rotation);
    text += std::to_string(i + 1);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), pose.translation.x(),
                               pose.translation.y(), pose.translation.z()})
      text += " " + to_text(value);
    const std::string& name = set.images.empty() ? set.cameras[i].name : set.images[i];
    text += " " + std::to_string(i + 1) + " " + name + "\n" + sightings[i] + "\n";
  }
  return text;
}

std::string colmap_points_text(const std::vector<SparsePoint>& points) {
  if (points.empty()) return "# 3D point list: empty\n";
  std::string text =
      "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, then IMAGE_ID and POINT2D_IDX of each "
      "image that shows it\n";
  std::map<std::uint32_t, std::size_t> count;  // sightings so far of each image
  for (std::size_t p = 0; p < points.size(); ++p) {
    const SparsePoint& point = points[p];
    text += std::to_string(p + 1);
    for (int k = 0; k < 3; ++k) text += " " + to_text(point.place_mm[k], kPlaceDigits);
    for (const std::uint8_t channel : point.srgb) text += " " + std::to_string(channel);
    text += " 0";  // the sightings are the point's own projections
    for (const SparsePoint::Sighting& seen : point.seen)
      text += " " + std::to_string(seen.image + 1) + " " + std::to_string(count[seen.image]++);
    text += "\n";
  }
  return text;
}

CameraSet read_colmap_binary(const fs::path& folder) {
  const std::map<std::uint32_t, Intrinsics> lenses = binary_lenses(folder / "cameras.bin");
  const fs::path path = folder / "images.bin";
  const std::vector<std::byte> bytes = read_file(path);
  PackedReader reader(bytes, path.string());
  CameraSet set;
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
  }
  reader.end();
  return set;
}

}  // namespace organbake
