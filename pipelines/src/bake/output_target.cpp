// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/output_target.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "organbake/bundle/bundle.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

void check_parent(const fs::path& target) {
  fs::path parent = fs::absolute(target).parent_path();
  while (!fs::exists(parent) && parent.has_relative_path()) parent = parent.parent_path();
  if (!fs::is_directory(parent)) {
    throw IoError::writing(target, parent.string() + " is a file, not a folder");
  }
  if (::access(parent.c_str(), W_OK | X_OK) != 0) {
    throw IoError::writing(target,
                           "cannot be written: " + parent.string() + ": " + std::strerror(errno));
  }
}

void add_listed_files(const fs::path& document, const std::set<std::string>& schemas,
                      std::set<std::string>& listed) {
  if (!fs::is_regular_file(document)) return;
  const Json json = Json::parse(read_text_file(document), nullptr, false);
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string()) return;
  if (!schemas.contains(json["schema"].get<std::string>())) return;
  listed.insert(document.filename().string());
  for (const Json& file : json.value("files", Json::array())) {
    const Json path = file.is_object() ? file.value("path", Json()) : file;
    if (path.is_string()) listed.insert(path.get<std::string>());
  }
}

}  // namespace

void check_output_file(const fs::path& file, const fs::path& ending) {
  if (file.has_extension() && file.extension() != ending) {
    throw UsageError(file.string() + ": the result is written as " + ending.string() +
                     "; give it that ending");
  }
  check_parent(file_to_write(file));
}

void check_output_folder(const fs::path& folder) {
  check_parent(folder.has_filename() ? folder : folder.parent_path());
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) throw IoError::writing(folder, "is a file; name a folder");
  std::set<std::string> ours;
  add_listed_files(folder / "manifest.json", {kBundleSchema, kSkinnedBundleSchema}, ours);
  add_listed_files(folder / "report.json", {"organbake/stage-report/1"}, ours);
  for (const fs::path& file : list_files(folder)) {
    if (ours.contains(file.generic_string())) continue;
    throw IoError::writing(folder, "holds " + file.generic_string() +
                                       ", which organbake did not write; choose another folder "
                                       "or move it away");
  }
}

void make_folder_of(const fs::path& file) {
  if (file.has_parent_path()) make_folder(file.parent_path());
}

void copy_into(const fs::path& from, const fs::path& to) {
  make_folder_of(to);
  // The library's own copying calls a disk that fills up on the way an input/output error.
  write_file_atomically(to, read_file(from));
}

}  // namespace organbake
