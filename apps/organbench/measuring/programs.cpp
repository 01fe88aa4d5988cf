// SPDX-License-Identifier: GPL-3.0-or-later
// organbake run as users run it, and the player's frames as they are timed.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "measuring/agreement.h"
#include "measuring/programs.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/processes.h"
#include "organbake/player/orbit.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

fs::path organbake_program() { return program_folder() / "organbake"; }

}  // namespace

Baker::Baker(fs::path folder, RunContext context, const std::string& recipe)
    : folder_(std::move(folder)), context_(std::move(context)) {
  if (!fs::exists(organbake_program())) {
    throw NoInputError(organbake_program(), "is not there; the bundles are baked with it");
  }
  write_file_atomically(folder_ / "recipe.yaml", recipe);
}

nlohmann::ordered_json Baker::bake(const fs::path& bundle,
                                   std::vector<std::string> arguments) const {
  std::vector<std::string> command = {organbake_program(), "bake", "--quiet", "--json"};
  command.insert(command.end(),
                 {folder_ / "recipe.yaml", "-o", bundle, "--cache", folder_ / "cache"});
  command.insert(command.end(), arguments.begin(), arguments.end());
  run_worker(command, folder_ / "bake.out", folder_ / "bake.log", context_);
  return nlohmann::ordered_json::parse(read_text_file(folder_ / "bake.out"));
}

namespace fs = std::filesystem;
namespace {

// Without a round to warm up, which would leave its results in the cache of the one that counts.
constexpr double kOnce_s = 1e-9;

WorkerEnd call_organbake(std::vector<std::string> words, const fs::path& folder,
                         const RunContext& context) {
  words.insert(words.begin(), program_folder() / "organbake");
  words.insert(words.end(), {"--quiet", "-o", folder});
  const std::string logs = folder.string();
  return run_worker(words, logs + ".out", logs + ".log", context);
}

}  // namespace

fs::path make_motion_clip(const fs::path& folder, const std::vector<std::string>& options,
                          const RunContext& context) {
  if (!fs::exists(folder)) {
    context.info("making the clip " + folder.filename().string());
    std::vector<std::string> words = {"phantom", "--kind", "laparoscopy"};
    words.insert(words.end(), options.begin(), options.end());
    call_organbake(words, folder, context);
  }
  const fs::path video = folder / "clip.mp4";
  return fs::exists(video) ? video : folder / "frames";
}

MotionRun run_motion(const fs::path& clip, const fs::path& lens, const fs::path& folder,
                     const RunContext& context) {
  MotionRun run{folder, {}, 0, {}};
  std::vector<std::string> words = {"motion", clip};
  if (!lens.empty()) words.insert(words.end(), {"--intrinsics", lens});
  const auto work = [&] {
    try {
      run.peak_mb = call_organbake(words, folder, context).peak_mb;
    } catch (const CancelledError&) {
      throw;
    } catch (const Error& error) {
      run.refusal = error.what();
    }
  };
  run.timing = time_in_turn({work}, {.most = 1, .least = 1, .budget_s = kOnce_s}).front();
  return run;
}

Plane read_depth(const fs::path& exr) {
  const ChannelImage image = read_exr(exr);
  Plane depth(image.width, image.height);
  depth.values = image.floats("Z", exr.string());
  return depth;
}

fs::path frame_file(const fs::path& folder, int frame, const std::string& ending) {
  constexpr std::size_t kDigits = 6;
  return folder / (padded(static_cast<std::size_t>(frame), kDigits) + ending);
}

std::vector<int> frames_with_depth(const fs::path& folder) {
  std::vector<int> frames;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none))
    if (const auto frame = frame_of_name(entry.path().filename())) frames.push_back(*frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

namespace {
namespace fs = std::filesystem;

// From the phantom organ to a bundle; −470 HU: half-way between its tissue and air.
constexpr const char* kRecipe = R"(schema: organbake/recipe/1
name: player benchmark
phantom: {kind: organ, seed: 1, photos: 8}
isosurface: {iso: -470}
decimate: {}
mechanics: {}
place: {count: 8}
capture: {}
bundle: {surface: true}
)";

}  // namespace

PlayerBundles::PlayerBundles(fs::path folder, RunContext context, bool small)
    : folder_(std::move(folder)),
      context_(std::move(context)),
      small_(small),
      baker_(folder_, context_, kRecipe) {}

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

namespace {

constexpr double kDistance = 0.74;

double azimuth(const Eigen::Vector3d& direction) {
  return std::atan2(direction.y(), direction.x());
}
double elevation(const Eigen::Vector3d& direction) { return std::asin(direction.z()); }

}  // namespace

View view_at(const Bundle& bundle, const FrameSize& size, int frame) {
  constexpr double kPerFrame_rad = 0.05;
  return orbit_view(bundle.cameras, {.azimuth_rad = kPerFrame_rad * frame, .distance = kDistance},
                    size.width, size.height);
}

View view_between_three(const Bundle& bundle, const FrameSize& size, int frame) {
  constexpr double kPerFrame_rad = 0.002;
  const ViewManifold& manifold = bundle.cameras.manifold;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t camera : manifold.triangles.at(0)) middle += manifold.directions[camera];
  middle.normalize();
  const Eigen::Vector3d& first = manifold.directions.front();
  return orbit_view(bundle.cameras,
                    {.azimuth_rad = azimuth(middle) - azimuth(first) + kPerFrame_rad * frame,
                     .elevation_rad = elevation(middle) - elevation(first),
                     .distance = kDistance},
                    size.width, size.height);
}

double ms_of(const Timing& timing) { return timing.cpu_ms.median / kFrames; }

Timing of_one(Timing timing, std::size_t count) {
  for (Spread* spread : {&timing.wall_ms, &timing.cpu_ms}) {
    for (double* value : {&spread->median, &spread->least, &spread->most}) *value /= double(count);
  }
  return timing;
}

}  // namespace organbake
