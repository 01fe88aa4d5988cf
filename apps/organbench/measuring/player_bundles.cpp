// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/player_bundles.h"

#include <nlohmann/json.hpp>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr const char* kScene = R"(phantom: {kind: organ, seed: 1, photos: 8}
place: {count: 8}
bundle: {surface: true}
)";

}  // namespace

PlayerBundles::PlayerBundles(fs::path folder, RunContext context, bool small)
    : folder_(std::move(folder)),
      context_(std::move(context)),
      small_(small),
      baker_(folder_, context_, organ_recipe("player benchmark", kScene)) {}

fs::path PlayerBundles::folder(const BakeChoice& choice) {
  const std::string faces = std::to_string(choice.faces), size = std::to_string(choice.map_size);
  const fs::path folder =
      folder_ / (choice.method + "-" + faces + "-" + size + (choice.elements ? "-fem" : "") +
                 (choice.skin ? "" : "-prism"));
  if (fs::exists(folder)) return folder;
  context_.info("baking " + faces + " faces (" + choice.method + "), maps of " + size + "²");
  std::vector<std::string> arguments;
  // The truth's colours are as fine as the largest maps' texels, or it would be the blurred one.
  for (const std::string& value :
       {"decimate.faces=" + faces, "decimate.method=" + choice.method, "place.size_px=" + size,
        std::string("mechanics.fem=") + (choice.elements ? "true" : "false"),
        std::string("phantom.size_voxels=") + (small_ ? "96,96,40" : "256,256,96"),
        std::string("phantom.photo_size_px=") + (small_ ? "256" : "1024"),
        std::string("capture.surface_edge_mm=") + (small_ ? "2" : "0.7")}) {
    arguments.insert(arguments.end(), {"--set", value});
  }
  if (!choice.skin) arguments.insert(arguments.end(), {"--set", "capture.skin_edge_mm=0"});
  baker_.bake(folder, arguments);
  return folder;
}

const SkinnedMesh& PlayerBundles::skinned_mesh(int subdivisions) {
  const auto known = skinned_.find(subdivisions);
  if (known != skinned_.end()) return known->second;
  const BundleReader reader(folder({80, "fitted", map_size()}));
  constexpr int kSkin_px = 1024;
  return skinned_[subdivisions] =
             organbake::skinned_mesh(reader.read_surface(), subdivisions, kSkin_px);
}

}  // namespace organbake
