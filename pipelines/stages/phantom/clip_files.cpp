// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/phantom/clip_files.h"

#include <utility>
#include <vector>

#include "organbake/core/text.h"
#include "organbake/image/exr.h"

namespace organbake {

std::string phantom_json(const std::string& options_json) {
  return "{\"schema\": \"organbake/phantom/1\", \"options\": " + options_json + "}\n";
}

std::string frame_number(int frame) {
  constexpr std::size_t kDigits = 6;
  return padded(static_cast<std::size_t>(frame), kDigits);
}

void write_frame_truth(const std::filesystem::path& file, const LaparoscopyFrame& frame) {
  ChannelImage image{frame.depth_mm.width,
                     frame.depth_mm.height,
                     {{"Y", frame.depth_mm.values}, {"Z", frame.depth_mm.values}}};
  for (int c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (const Eigen::Vector3f& normal : frame.normals) values.push_back(normal[c]);
    image.channels.push_back({std::string("normal.") + "XYZ"[c], std::move(values), true});
  }
  for (const auto& [name, mask] :
       {std::pair{"highlight", &frame.highlights}, std::pair{"instrument", &frame.instrument}})
    image.channels.push_back(
        {name, std::vector<float>(mask->values.begin(), mask->values.end()), true});
  write_exr(file, image, {.camera = frame.camera});
}

}  // namespace organbake
