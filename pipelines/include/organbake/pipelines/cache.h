// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

// XXH3-128 as 32 hexadecimal digits: names content in the cache. It is quick, not proof against an
// attacker; what leaves the cache in a bundle carries SHA-256.
std::string quick_hash(std::string_view text);
// Throws NoInputError or IoError.
std::string quick_hash_of_file(const std::filesystem::path& path);

// Whether a file begins as DICOM files do. Throws NoInputError or IoError.
bool has_dicom_mark(const std::filesystem::path& path);

// One hash for all that an input consists of: the file itself, all below a folder, a header's data
// file, the photographs of a cameras.json … Of one file it is the file's, of several that of the
// list of names and hashes, in byte order of the names. Throws NoInputError for a path that is
// missing or an empty folder.
using FileHasher = std::string (*)(const std::filesystem::path&);
std::string content_hash(InputKind kind, const std::filesystem::path& path, FileHasher hash_file);
std::string sha256_of_file(const std::filesystem::path& path);

// All that a step's result depends on. Two steps with equal ingredients give equal bytes.
struct StepIngredients {
  std::string stage;
  std::string program;                        // hash of the module that runs it
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
  // Hashes of the modules beside the stage's own that were loaded, by their names.
  std::map<std::string, std::string> modules = {};
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
  // Nothing when the entry is missing, a file of it is not of the recorded size, or a module that
  // it was made with is another now.
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

struct LockOptions {
  std::filesystem::path file;
  // The file stays, and the processes that this one starts hold the lock as well; else it is taken
  // away again.
  bool inherited = false;
  std::chrono::milliseconds patience{0};  // for others
  std::string busy;                       // what is said when that was not enough
};

// The system's lock of a file, held while results are put in their place: of two programs that
// write to one place the second waits until the first is done, so that nothing of either is lost,
// mixed or read half-way. When one is killed, the next takes over at once.
class FileLock {
 public:
  // Throws Error (try again, 75) with the options' `busy`, CancelledError, or IoError when a file
  // that stays can't be made. Where the file system knows no locks, or lets nobody make the file,
  // all go on without: what is written next tells.
  explicit FileLock(LockOptions options, const RunContext& context = {});
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  bool try_once();

  LockOptions options_;
  int fd_ = -1;
};

// For what is written at `target`, a file or a folder: a hidden file beside it, ".organ.lock".
// Makes the folders above. Throws IoError (writing).
LockOptions output_lock(const std::filesystem::path& target);

}  // namespace organbake
