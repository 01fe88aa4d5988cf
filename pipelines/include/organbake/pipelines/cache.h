// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "organbake/pipelines/stage.h"

namespace organbake {

// All that a step's result depends on. Two steps with equal ingredients give equal bytes.
struct StepIngredients {
  std::string stage;
  int version = 1;
  std::string options_json;                   // resolved, canonical
  std::map<std::string, std::string> inputs;  // name → content hash

  std::string key() const;  // XXH3-128 of them all
};

struct CachedFile {
  std::string path;  // relative to the entry
  std::uint64_t bytes = 0;
  std::string hash;
};

// What a run tells besides its files. Only the report belongs to the result: the same step takes
// other times, and warns of files by other names, elsewhere.
struct StepRecord {
  std::string report_json;
  double seconds = 0;  // 0 = not known
  std::vector<std::string> warnings = {};
};

// One finished step: a folder named by its key that holds the outputs and step.json.
struct CacheEntry {
  std::filesystem::path folder;
  StepIngredients ingredients;
  std::vector<CachedFile> files;
  StepRecord record;

  // The content hash of one output: a file, or (".") all of them, or a document with what lies
  // beside it in a folder of its own ("photos/cameras.json"). Equals content_hash() of the same
  // files, without reading them.
  std::string content_hash(const std::string& output) const;
  // Reads every file again. False when one is missing or has changed.
  bool sound() const;
};

// Results of steps, shared by every bake of a user. Entries appear whole or not at all, so
// concurrent bakes may share one folder and a killed one leaves nothing that counts.
class Cache {
 public:
  explicit Cache(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // $ORGANBAKE_CACHE, else $XDG_CACHE_HOME/organbake, else ~/.cache/organbake. Throws UsageError
  // when none can be told.
  static std::filesystem::path default_folder();
  // What the default falls back to where there is no home to write to.
  static std::filesystem::path temporary_folder();

  const std::filesystem::path& folder() const { return folder_; }
  // Nothing when the entry is missing or a file of it is not of the recorded size.
  std::optional<CacheEntry> find(const StepIngredients& ingredients) const;
  // Calls `make` with an empty folder to fill. An entry that
  // another process finished meanwhile is kept unless `replace`.
  CacheEntry store(const StepIngredients& ingredients, bool replace,
                   const std::function<StepRecord(const std::filesystem::path&)>& make) const;
  // The entry of this stage whose ingredients differ least: what --explain compares with.
  std::optional<StepIngredients> nearest(const StepIngredients& ingredients) const;

 private:
  std::filesystem::path folder_;
};

// "faces was 80, is 100", "surface has changed" …; empty when they are equal.
std::vector<std::string> differences(const StepIngredients& before, const StepIngredients& now);

}  // namespace organbake
