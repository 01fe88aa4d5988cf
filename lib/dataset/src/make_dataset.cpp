// SPDX-License-Identifier: Apache-2.0
// Makes a data set: whatever shards are missing, then the card that says what is in all of them.
#include "organbake/dataset/dataset.h"

#include <algorithm>
#include <memory>

#include "dataset_shard.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"

namespace organbake {
namespace {

struct OrganCounts {
  std::int64_t frames = 0, frames_with_contact = 0, shards = 0;
  double largest_force_n = 0;
};

std::vector<OrganCounts> count_shards(const DatasetPlan& plan,
                                      const std::filesystem::path& folder) {
  std::vector<OrganCounts> counts(plan.organs.size());
  constexpr std::int64_t kMost = 1'000'000'000;
  for (const DatasetShard& shard : plan.shards) {
    const std::string name = (folder / shard.folder / "shard.json").string();
    const Json json = parse_json(read_text_file(name), name);
    const JsonField document(json, name);
    OrganCounts& organ = counts[shard.organ];
    ++organ.shards;
    organ.frames += document["frames"].integer(0, kMost);
    organ.frames_with_contact += document["frames_with_contact"].integer(0, kMost);
    organ.largest_force_n =
        std::max(organ.largest_force_n, document["largest_force_n"].number(0, 1e9));
  }
  return counts;
}

Json organs_json(const DatasetPlan& plan, const std::vector<OrganCounts>& counts) {
  Json organs = Json::array();
  for (std::size_t o = 0; o < plan.organs.size(); ++o)
    organs.push_back({{"name", plan.organs[o].name},
                      {"split", plan.organs[o].test ? "test" : "train"},
                      {"shards", counts[o].shards},
                      {"frames", counts[o].frames},
                      {"frames_with_contact", counts[o].frames_with_contact},
                      {"largest_force_n", counts[o].largest_force_n}});
  return organs;
}

std::string row(const std::vector<std::string>& cells, const char* tag) {
  std::string text = "<tr>";
  for (const std::string& cell : cells)
    text += std::string("<") + tag + ">" + escape_html(cell) + "</" + tag + ">";
  return text + "</tr>\n";
}

constexpr const char* kPageHead =
    "<meta charset=\"utf-8\"><style>body{font:16px sans-serif;max-width:60em;margin:2em auto}"
    "td,th{padding:.2em .8em;text-align:left}img{width:18em;margin:.3em}pre{background:#eee;"
    "padding:1em}</style>\n";

constexpr const char* kFiles =
    "<p>Each shard holds frame_0000.png and on (8-bit sRGB), the layers that were asked for "
    "(depth_, flow_, normals_, id_ and weight_ as EXR, mask_ as PNG of labels: 0 background, 1 "
    "tissue, 101 and on the instruments; tracks_ of each clip as NPZ of points, occluded and "
    "xyz_mm), cameras.json, scenes.jsonl with instruments, forces and "
    "the proxy's vertices, and shard.json with its clips. The right eye of a stereo pair lies in "
    "right/. Millimetres and newtons, LPS; camera axes x right, y down, z forward.</p>\n";

std::string no_split(const DatasetSpec& spec, const DatasetPlan& plan) {
  if (plan.organs.size() != 1 || spec.test_share == 0) return "";
  return "test_share is of the organs, and there is one: all of it is for training";
}

std::string page(const DatasetSpec& spec, const DatasetPlan& plan, const Json& card) {
  const std::string title = escape_html(spec.name);
  std::string html =
      "<!doctype html><html lang=\"en\"><title>" + title + "</title>" + kPageHead + "<h1>" + title +
      "</h1>\n<table>" +
      row({"organ", "split", "shards", "frames", "with contact", "largest force, N"}, "th");
  for (const Json& organ : card["organs"])
    html +=
        row({organ["name"].get<std::string>(), organ["split"].get<std::string>(),
             organ["shards"].dump(), organ["frames"].dump(), organ["frames_with_contact"].dump(),
             to_text(organ["largest_force_n"].get<double>(), 2)},
            "td");
  html += "</table>\n<p>" + no_split(spec, plan) + "</p>\n";
  for (const DatasetShard& shard : plan.shards)
    if (shard.first_clip == 0)
      html += "<img alt=\"\" src=\"" + escape_html(shard.folder + "/" + frame_file_name(0)) + "\">";
  return html + "\n" + kFiles + "<pre>" + escape_html(dataset_spec_to_json(spec)) +
         "</pre></html>\n";
}

// What is in a finished data set, by its shards' own accounts: card.json and the page index.html.
void write_dataset_card(const DatasetSpec& spec, const DatasetPlan& plan,
                        const std::filesystem::path& folder, const std::string& generator) {
  const std::vector<OrganCounts> counts = count_shards(plan, folder);
  const Json card = {{"schema", "organbake/dataset-card/1"},
                     {"name", spec.name},
                     {"generator", generator},
                     {"frames", plan.frames},
                     {"organs", organs_json(plan, counts)},
                     {"spec", parse_json(dataset_spec_to_json(spec), "spec")}};
  write_file_atomically(folder / "card.json", json_text(card));
  write_file_atomically(folder / "index.html", page(spec, plan, card));
}

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

// Before the first shard: springs cannot be cut.
void check_tools(const DatasetSpec& spec, const DatasetPlan& plan) {
  const bool cuts = std::any_of(spec.tools.begin(), spec.tools.end(), has_blade);
  for (const DatasetOrgan& organ : plan.organs)
    if (cuts && !BundleReader(organ.bundle).read_frame().mechanics.body)
      throw UsageError(
          organ.bundle.string() +
          " was baked without tetrahedra and cannot be cut; bake it anew, or leave cut "
          "out of pokes.tools");
}

}  // namespace

DatasetSummary make_dataset(const DatasetSpec& spec, const std::vector<fs::path>& bundles,
                            const fs::path& folder, const std::string& generator,
                            const RunContext& context) {
  const DatasetPlan plan = plan_dataset(spec, bundles);
  const auto lens =
      spec.lens ? std::make_shared<const LensPicture>(*spec.lens, "the data set's lens") : nullptr;
  check_tools(spec, plan);
  claim(folder, identity(spec, plan));
  if (const std::string why = no_split(spec, plan); !why.empty()) context.info(why);
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
      for (const DrawnLight light : spec.lights) player->light_for(light);  // throws, before work
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
