// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>
#include <thread>

#include "core/error.h"
#include "core/files.h"
#include "organbake/commands.h"
#include "pipelines/stage_module.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct Check {
  std::string what, finding;
  ExitCode code = ExitCode::ok;
  bool ok() const { return code == ExitCode::ok; }
};

Check check_modules() {
  std::string missing;
  std::vector<std::string> names = {"inspect", "export"};
  for (const Stage& stage : all_stages()) names.push_back(stage.name);
  for (const std::string& name : names) {
    if (!fs::exists(module_file(name))) missing += " " + module_file(name).string();
  }
  return {"modules", missing.empty() ? module_folder().string() : "missing:" + missing,
          missing.empty() ? ExitCode::ok : ExitCode::internal};
}

std::string megabytes(const fs::path& folder) {
  std::uint64_t bytes = 0;
  if (fs::exists(folder)) {
    for (const fs::path& file : list_files(folder)) bytes += fs::file_size(folder / file);
  }
  return std::to_string(bytes / 1000000) + " MB";
}

Check check_cache(const fs::path& folder) {
  try {
    const AtomicFolder trial(folder / "doctor");  // never committed, so it leaves nothing
    return {"cache", folder.string() + ", " + megabytes(folder)};
  } catch (const Error& error) {
    return {"cache", std::string(error.what()) + "; name another by --cache or ORGANBAKE_CACHE",
            error.code()};
  }
}

}  // namespace

int run_doctor(const Arguments& arguments, Session& session) {
  fs::path cache;
  OptionList options;
  options.add("cache", &cache, {.help = "folder of the cache"});
  const auto words = session.read_command(
      arguments, "doctor", "Checks this installation: modules, cache, processor.", options, 0);
  if (!words) return 0;
  const std::vector<Check> checks = {
      {"version", ORGANBAKE_VERSION},
      {"processor", std::to_string(std::thread::hardware_concurrency()) + " threads, AVX2"},
      check_modules(),
      check_cache(cache.empty() ? Cache::default_folder() : cache)};
  std::string text;
  nlohmann::json json = nlohmann::json::object();
  ExitCode code = ExitCode::ok;  // of the first that is not
  for (const Check& check : checks) {
    text += (text.empty() ? "" : "\n") + std::string(check.ok() ? "ok   " : "BAD  ") + check.what +
            ": " + check.finding;
    json[check.what] = {{"ok", check.ok()}, {"finding", check.finding}};
    if (code == ExitCode::ok) code = check.code;
  }
  session.print_result(text, json);
  return static_cast<int>(code);
}

}  // namespace organbake
