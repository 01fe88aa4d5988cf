// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "organbake/core/files.h"
#include "organbake/pipelines/output_target.h"
#include "organbake/pipelines/outputs.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

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

std::string folder_report(const std::string& report_json, const std::vector<std::string>& files) {
  nlohmann::json report = nlohmann::json::parse(report_json);
  report["files"] = files;
  return report.dump(2) + "\n";
}

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
  std::vector<std::string> files;
  for (const CachedFile& file : result.entry.files) {
    copy_into(result.entry.folder / file.path, folder.path() / file.path);
    files.push_back(file.path);
  }
  write_file_atomically(folder.path() / "report.json",
                        folder_report(result.entry.record.report_json, files));
  folder.commit();
}

}  // namespace organbake
