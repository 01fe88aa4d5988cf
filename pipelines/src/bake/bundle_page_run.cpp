// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/bundle_page_run.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/sha256.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

constexpr const char* kStart = "<script type=\"application/json\" id=\"bake\">";
constexpr const char* kEnd = "</script>";

std::string manifest_hash(const BundleReader& reader) {
  return sha256_hex(read_file(reader.folder() / "manifest.json"));
}

BakeRun run_from(const Json& json) {
  BakeRun run;
  run.seconds = json.at("seconds");
  for (const Json& stage : json.at("stages")) {
    run.stages.push_back(
        {stage.at("name"), stage.at("seconds"), stage.at("cached"), stage.at("warnings")});
  }
  return run;
}

}  // namespace

std::string run_script(const BundleReader& reader, const BakeRun& run) {
  Json stages = Json::array();
  for (const BakeRun::Stage& stage : run.stages) {
    stages.push_back({{"name", stage.name},
                      {"seconds", stage.seconds},
                      {"cached", stage.cached},
                      {"warnings", stage.warnings}});
  }
  const Json json = {
      {"manifest_sha256", manifest_hash(reader)}, {"seconds", run.seconds}, {"stages", stages}};
  // No warning may end the script.
  std::string text;
  for (const char c : json.dump(-1, ' ', true, Json::error_handler_t::replace))
    c == '<' ? text += "\\u003c" : text += c;
  return kStart + text + kEnd + "\n";
}

namespace {

std::filesystem::path beside(const std::filesystem::path& bundle, const char* ending) {
  std::filesystem::path folder = bundle.lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "organ/"
  // "." has no name of its own to add to.
  if (folder.filename() == "." || folder.filename() == ".." || folder.filename().empty())
    folder = std::filesystem::absolute(bundle).lexically_normal().parent_path();
  return folder.parent_path() / (folder.filename().string() + ending);
}

}  // namespace

std::filesystem::path page_beside(const std::filesystem::path& bundle) {
  return beside(bundle, "_report.html");
}

std::filesystem::path player_page_beside(const std::filesystem::path& bundle) {
  return beside(bundle, "_player.html");
}

std::string player_link(const std::filesystem::path& bundle, const std::filesystem::path& report) {
  const auto player = std::filesystem::absolute(player_page_beside(bundle));
  return player.lexically_proximate(std::filesystem::absolute(report).parent_path())
      .generic_string();
}

std::optional<BakeRun> run_of_page(const std::filesystem::path& page, const BundleReader& reader) {
  if (!std::filesystem::is_regular_file(page)) return std::nullopt;
  const std::string text = read_text_file(page);
  const std::size_t start = text.find(kStart);
  const std::size_t end = start == std::string::npos ? start : text.find(kEnd, start);
  if (end == std::string::npos) return std::nullopt;
  const std::size_t first = start + std::string_view(kStart).size();
  try {
    const Json json = Json::parse(text.substr(first, end - first));
    if (json.at("manifest_sha256") != manifest_hash(reader)) return std::nullopt;
    return run_from(json);
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace organbake
