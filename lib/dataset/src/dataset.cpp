// SPDX-License-Identifier: Apache-2.0
#include "organbake/dataset/dataset.h"

#include <memory>

#include "dataset_card.h"
#include "dataset_plan.h"
#include "dataset_shard.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/player/player.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

// What a run must have been started with to be gone on with: the spec, and the bundles' contents.
std::string identity(const DatasetSpec& spec, const DatasetPlan& plan) {
  Json json = parse_json(dataset_spec_to_json(spec), "spec");
  Json organs = Json::array();
  for (const DatasetOrgan& organ : plan.organs) {
    Json files = Json::array();
    const BundleReader reader(organ.bundle);
    for (const BundleFile& file : reader.manifest().files)
      files.push_back({file.path, file.sha256});
    organs.push_back({{"name", organ.name}, {"files", files}});
  }
  json["organs"] = organs;
  return json_text(json);
}

// Takes a new or empty folder, or one that an earlier run of the same data set has begun.
void claim(const fs::path& folder, const std::string& wanted) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder))
    throw IoError::writing(folder, "cannot be made a folder; name another");
  const fs::path file = folder / "spec.json";
  if (fs::exists(file)) {
    if (read_text_file(file) == wanted) return;
    throw UsageError(folder.string() +
                     ": holds the data set of another spec or of other bundles; name another "
                     "folder, or remove it");
  }
  if (!fs::is_empty(folder))
    throw UsageError(folder.string() + ": holds something else; name a new folder");
  write_file_atomically(file, wanted);
}

void check_lights(const DatasetSpec& spec, const DatasetOrgan& organ, const Player& player) {
  for (const DrawnLight light : spec.lights)
    if (light != DrawnLight::baked && !player.can_relight())
      throw UsageError(organ.bundle.string() + " does not say in what light its colours were " +
                       "taken: light " + to_string(light) + " cannot be shown");
}

}  // namespace

DatasetSummary make_dataset(const DatasetSpec& spec, const std::vector<fs::path>& bundles,
                            const fs::path& folder, const std::string& generator,
                            const RunContext& context) {
  const DatasetPlan plan = plan_dataset(spec, bundles);
  const auto lens =
      spec.lens ? std::make_shared<const LensPicture>(*spec.lens, "the data set's lens") : nullptr;
  claim(folder, identity(spec, plan));
  DeformOptions deform;
  deform.time_step_s = spec.time_step_s;
  DatasetSummary summary;
  summary.frames = plan.frames;
  std::unique_ptr<Player> player;
  std::size_t loaded = 0;
  for (std::size_t s = 0; s < plan.shards.size(); ++s) {
    const DatasetShard& shard = plan.shards[s];
    context.throw_if_cancelled();
    if (fs::exists(folder / shard.folder)) {
      ++summary.shards_kept;
      continue;
    }
    if (!player || loaded != shard.organ) {
      player.reset();  // before the next one takes its memory
      player = std::make_unique<Player>(plan.organs[shard.organ].bundle, deform);
      player->load_all();
      loaded = shard.organ;
      check_lights(spec, plan.organs[loaded], *player);
    }
    context.progress(shard.begin);
    make_shard(spec, lens, shard, *player, folder, context);
    ++summary.shards_made;
    context.info(shard.folder + " is there, " + std::to_string(s + 1) + " of " +
                 std::to_string(plan.shards.size()));
  }
  write_dataset_card(spec, plan, folder, generator);
  return summary;
}

}  // namespace organbake
