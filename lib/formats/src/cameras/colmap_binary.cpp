// SPDX-License-Identifier: GPL-3.0-or-later
// COLMAP's own files, cameras.bin and images.bin (its documentation, "Output Format").
#include <map>

#include "cameras/colmap_parts.h"
#include "cameras/foreign_cameras.h"
#include "organbake/bundle/packed_bytes.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

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
