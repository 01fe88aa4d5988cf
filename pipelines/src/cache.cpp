// SPDX-License-Identifier: GPL-3.0-or-later
// The cache of steps: what a step made lies under the key of its options, inputs and program, and
// is found, checked and stored there while other bakes do the same.
#include "organbake/pipelines/cache.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CachedFile, path, bytes, hash)
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

constexpr const char* kStepFile = "step.json";
constexpr const char* kStepSchema = "organbake/step/1";

std::vector<CachedFile> hash_outputs(const fs::path& folder) {
  std::vector<CachedFile> files;
  for (const fs::path& file : list_files(folder)) {
    files.push_back(
        {file.generic_string(), fs::file_size(folder / file), quick_hash_of_file(folder / file)});
  }
  return files;
}

std::string step_json(const CacheEntry& entry) {
  const StepIngredients& step = entry.ingredients;
  const Json json = {{"schema", kStepSchema},
                     {"stage", step.stage},
                     {"program", step.program},
                     {"options", Json::parse(step.options_json)},
                     {"inputs", step.inputs},
                     {"files", entry.files},
                     {"report", Json::parse(entry.record.report_json)},
                     {"seconds", entry.record.seconds},
                     {"warnings", entry.record.warnings},
                     {"modules", entry.record.modules}};
  // A warning may name a file, and file names need not be UTF-8.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

CacheEntry read_entry(const fs::path& folder) {
  const Json json = Json::parse(read_text_file(folder / kStepFile));
  // Older entries don't tell how they were made.
  return {
      folder,
      {json.at("stage"), json.value("program", ""), json.at("options").dump(), json.at("inputs")},
      json.at("files"),
      {json.at("report").dump(), json.value("seconds", 0.0),
       json.value("warnings", std::vector<std::string>()),
       json.value("modules", std::map<std::string, std::string>())}};
}

// A step.json that cannot be read counts as no entry: the step then runs again and mends it.
std::optional<CacheEntry> try_read_entry(const fs::path& folder) {
  try {
    return read_entry(folder);
  } catch (const Json::exception&) {
    return std::nullopt;
  } catch (const Error&) {
    return std::nullopt;
  }
}

bool sizes_match(const CacheEntry& entry) {
  return std::all_of(entry.files.begin(), entry.files.end(), [&](const CachedFile& file) {
    std::error_code error;
    return fs::file_size(entry.folder / file.path, error) == file.bytes && !error;
  });
}

bool modules_match(const CacheEntry& entry) {
  const auto& modules = entry.record.modules;
  return std::all_of(modules.begin(), modules.end(), [](const auto& module) {
    const fs::path file = module_folder() / module.first;
    return fs::exists(file) && quick_hash_of_file(file) == module.second;
  });
}

// Containers run without a home, or with one that nobody may write to.
bool can_be_made(fs::path folder) {
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  return ::access(folder.c_str(), W_OK | X_OK) == 0;
}

}  // namespace

std::string StepIngredients::key() const {
  std::string text = stage + "\n" + program + "\n" + options_json + "\n";
  for (const auto& [name, hash] : inputs) text += name + " " + hash + "\n";
  return quick_hash(text);
}

std::string CacheEntry::content_hash(const std::string& output) const {
  const std::size_t slash = output.find('/');
  const std::string folder = slash == std::string::npos ? "" : output.substr(0, slash + 1);
  std::string list;
  for (const CachedFile& file : files) {
    if (file.path == output && folder.empty()) return file.hash;
    if (file.path.starts_with(folder)) {
      list += file.hash + "  " + file.path.substr(folder.size()) + "\n";
    }
  }
  return quick_hash(list);
}

bool CacheEntry::sound() const {
  try {
    return std::all_of(files.begin(), files.end(), [&](const CachedFile& file) {
      return quick_hash_of_file(folder / file.path) == file.hash;
    });
  } catch (const Error&) {
    return false;
  }
}

fs::path Cache::default_folder() {
  const auto variable = [](const char* name) -> fs::path {
    const char* value = std::getenv(name);
    return value && *value ? fs::path(value) : fs::path();
  };
  if (const fs::path own = variable("ORGANBAKE_CACHE"); !own.empty()) return own;
  if (const fs::path xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "organbake";
  const fs::path home = variable("HOME");
  if (!home.empty() && can_be_made(home)) return home / ".cache" / "organbake";
  return temporary_folder();
}

fs::path Cache::temporary_folder() {
  return fs::temp_directory_path() / ("organbake-cache-" + std::to_string(::getuid()));
}

std::optional<CacheEntry> Cache::find(const StepIngredients& ingredients) const {
  const fs::path folder = folder_ / ingredients.key();
  if (!fs::exists(folder / kStepFile)) return std::nullopt;
  std::optional<CacheEntry> entry = try_read_entry(folder);
  if (!entry || entry->ingredients.key() != ingredients.key() || !sizes_match(*entry) ||
      !modules_match(*entry)) {
    return {};
  }
  return entry;
}

CacheEntry Cache::store(const StepIngredients& ingredients, bool replace,
                        const std::function<StepRecord(const fs::path&)>& make) const {
  const fs::path target = folder_ / ingredients.key();
  AtomicFolder folder(target);
  CacheEntry entry{folder.path(), ingredients, {}, make(folder.path())};
  entry.files = hash_outputs(folder.path());
  write_file_atomically(folder.path() / kStepFile, step_json(entry));
  // An entry that find() refuses must not be kept either, or the step could never be mended.
  const bool mend = replace || !find(ingredients);
  folder.commit(mend ? AtomicFolder::IfExists::replace : AtomicFolder::IfExists::keep_existing);
  entry.folder = target;
  return entry;
}

std::optional<StepIngredients> Cache::nearest(const StepIngredients& ingredients) const {
  std::optional<StepIngredients> best;
  std::size_t fewest = SIZE_MAX;
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& item : fs::directory_iterator(folder_, error)) folders.push_back(item.path());
  std::sort(folders.begin(), folders.end());
  for (const fs::path& folder : folders) {
    if (folder.filename().string().starts_with('.')) continue;
    const auto entry = try_read_entry(folder);
    if (!entry || entry->ingredients.stage != ingredients.stage) continue;
    const std::size_t count = differences(entry->ingredients, ingredients).size();
    if (count > 0 && count < fewest) {
      fewest = count;
      best = entry->ingredients;
    }
  }
  return best;
}

std::vector<std::string> differences(const StepIngredients& before, const StepIngredients& now) {
  std::vector<std::string> list;
  if (before.program != now.program) list.push_back("its program is another");
  const Json old_options = Json::parse(before.options_json);
  const Json new_options = Json::parse(now.options_json);
  for (const auto& [name, value] : new_options.items()) {
    if (!old_options.contains(name)) {
      list.push_back(name + " is new");
    } else if (old_options[name] != value) {
      list.push_back(name + " was " + old_options[name].dump() + ", is " + value.dump());
    }
  }
  for (const auto& [name, hash] : now.inputs) {
    const auto old = before.inputs.find(name);
    if (old == before.inputs.end()) {
      list.push_back("the input " + name + " was not given");
    } else if (old->second != hash) {
      list.push_back("the input " + name + " has other content");
    }
  }
  for (const auto& [name, hash] : before.inputs) {
    if (!now.inputs.contains(name)) list.push_back("the input " + name + " is no longer given");
  }
  return list;
}

}  // namespace organbake
