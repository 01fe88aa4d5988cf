// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "organbake/core/files.h"
#include "organbake/pipelines/output_target.h"
#include "organbake/pipelines/outputs.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

// The stage's report with the list of the files beside it, by which a later run knows the folder
// for its own.
std::string folder_report(const CacheEntry& entry) {
  nlohmann::json report = nlohmann::json::parse(entry.record.report_json);
  for (const CachedFile& file : entry.files) report["files"].push_back(file.path);
  return report.dump(2) + "\n";
}

// "beside/overlay.png" of a result pose.json goes to pose_overlay.png.
void write_beside(const CacheEntry& entry, const fs::path& target) {
  const std::string prefix = std::string(Stage::kBeside) + "/";
  for (const CachedFile& file : entry.files) {
    if (!file.path.starts_with(prefix)) continue;
    const fs::path beside =
        target.parent_path() / (target.stem().string() + "_" + file.path.substr(prefix.size()));
    make_folder_of(beside);
    write_file_atomically(beside, read_file(entry.folder / file.path));
  }
}

}  // namespace

void check_stage_target(const Stage& stage, const fs::path& target) {
  if (stage.single_file) {
    check_output_file(target, fs::path(stage.outputs.front().file).extension());
  } else {
    check_output_folder(target);
  }
}

void write_stage_outputs(const StepResult& result, const fs::path& target) {
  const Stage& stage = *result.step->stage;
  check_stage_target(stage, target);
  if (stage.single_file) {
    make_folder_of(target);
    write_file_atomically(target, read_file(result.entry.folder / stage.outputs.front().file));
    write_beside(result.entry, target);
    return;
  }
  AtomicFolder folder(target);
  for (const CachedFile& file : result.entry.files) {
    copy_into(result.entry.folder / file.path, folder.path() / file.path);
  }
  write_file_atomically(folder.path() / "report.json", folder_report(result.entry));
  folder.commit();
}

}  // namespace organbake
