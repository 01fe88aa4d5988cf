// SPDX-License-Identifier: GPL-3.0-or-later
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <thread>

#include "commands.h"
#include "libraries.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/stage_module.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

struct Check {
  std::string what, finding;
  ExitCode code = ExitCode::ok;
  bool helper = false;  // what is missing only some commands need
  bool ok() const { return code == ExitCode::ok; }
};

// The system's own name for itself, and those that every test passes on.
Check check_system() {
  std::string name = "a system without /etc/os-release";
  std::ifstream file("/etc/os-release");
  for (std::string line; std::getline(file, line);) {
    constexpr std::string_view kName = "PRETTY_NAME=";
    if (line.starts_with(kName)) name = trimmed(line.substr(kName.size()), "\"");
  }
  const bool tried =
      name.starts_with("Debian GNU/Linux 12") || name.starts_with("Debian GNU/Linux 13");
  return {"system", name + (tried ? "" : "; tried are Debian 12 and 13")};
}

// What brings the libraries of a stage: of a package its dependencies, of a clone the script.
constexpr const char* kBringLibraries =
    "; bring it by 'apt-get install --fix-broken' (packages) or 'scripts/setup --programs' and "
    "'scripts/build release' (a clone)";

Check check_modules() {
  const std::vector<UnloadableModule> unloadable = unloadable_modules();
  if (unloadable.empty()) return {"modules", module_folder().string()};
  std::string reasons;
  for (const UnloadableModule& module : unloadable) {
    reasons += (reasons.empty() ? "" : "; ") + module.reason;
  }
  return {"modules", reasons + kBringLibraries, ExitCode::internal};
}

bool in_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (::access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

// Programs and parts beside organbake, each with what needs it and the command that brings it.
std::vector<Check> check_helpers() {
  const bool player = fs::exists(program_folder() / "organplay") || in_path("organplay");
  const bool window = fs::exists(module_folder() / "organplay_window.so");
  const auto check = [](const char* what, bool there, const char* without) {
    return Check{what, there ? "there" : std::string("missing: ") + without, ExitCode::ok, true};
  };
  return {
      check("organplay", player,
            "it plays bundles, and batch --pictures asks it for them; 'apt-get install "
            "./organplay_*.deb', or 'scripts/build release' in a clone"),
      check("organplay's window", window,
            "'apt-get install ./organplay-window_*.deb', or 'scripts/setup --programs' and "
            "'scripts/build release' in a clone"),
      check("ffmpeg", in_path("ffmpeg"), "organplay --video needs it; 'apt-get install ffmpeg'")};
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

std::string mark_of(const Check& check) {
  if (!check.ok()) return "BAD  ";
  return check.helper && check.finding != "there" ? "--   " : "ok   ";
}

}  // namespace

int run_doctor(const Arguments& arguments, Session& session) {
  fs::path cache;
  OptionList options;
  options.add("cache", &cache, {.help = "folder of the cache", .value = "DIR"});
  const auto words = session.read_command(
      arguments, "doctor",
      "Checks this installation: system, modules with their libraries, cache, processor, and the "
      "programs that some commands call. Tells for what is missing the command that brings it.",
      options, 0);
  if (!words) return 0;
  std::vector<Check> checks = {
      {"version", kVersion},
      check_system(),
      {"processor", std::to_string(std::thread::hardware_concurrency()) + " threads, AVX2"},
      check_modules(),
      check_cache(cache.empty() ? Cache::default_folder() : cache)};
  for (Check& helper : check_helpers()) checks.push_back(std::move(helper));
  std::string text;
  nlohmann::json json = nlohmann::json::object();
  ExitCode code = ExitCode::ok;  // of the first that is not
  for (const Check& check : checks) {
    text += (text.empty() ? "" : "\n") + mark_of(check) + check.what + ": " + check.finding;
    json[check.what] = {{"ok", check.ok()}, {"finding", check.finding}};
    if (code == ExitCode::ok) code = check.code;
  }
  session.print_result(text, json);
  return static_cast<int>(code);
}

}  // namespace organbake
