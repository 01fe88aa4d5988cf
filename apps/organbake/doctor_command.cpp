// SPDX-License-Identifier: GPL-3.0-or-later
// organbake doctor: whether this installation works, and which libraries it works with.
#include <CGAL/version.h>
#include <OpenEXR/OpenEXRConfig.h>
#include <dlfcn.h>
#include <libdeflate.h>
#include <link.h>
#include <openssl/opensslv.h>
#include <png.h>
#include <unistd.h>
#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <thread>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/stage.h"

// A macro's value as a text.
#define ORGANBAKE_TEXT_OF(value) #value
#define ORGANBAKE_TEXT(macro) ORGANBAKE_TEXT_OF(macro)

namespace organbake {
namespace {

// What people know them by; one of several files of a library stands for all.
constexpr std::pair<const char*, const char*> kFiles[] = {
    {"libvtkCommonCore-", "VTK"},       {"libopencv_core.so", "OpenCV"},
    {"libceres.so", "Ceres"},           {"libembree", "Embree"},
    {"libOpenMeshCore.so", "OpenMesh"}, {"libgdcmMSFF.so", "GDCM"},
    {"libcholmod.so", "CHOLMOD"},       {"libyaml-cpp.so", "yaml-cpp"},
    {"libavcodec.so", "libavcodec"},    {"libtbb.so", "TBB"}};

// "libceres.so.2.1.0" → "2.1.0"; of a file without one: "".
std::string version_in(const std::string& file) {
  const std::size_t at = file.find(".so.");
  return at == std::string::npos ? "" : file.substr(at + 4);
}

int note_library(dl_phdr_info* info, std::size_t, void* versions) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  // The name that is loaded is often a link to the file that carries the whole version.
  const fs::path loaded = info->dlpi_name, file = fs::weakly_canonical(loaded, ignored);
  for (const auto& [start, name] : kFiles) {
    if (!loaded.filename().string().starts_with(start)) continue;
    const std::string version = version_in(file.filename().string());
    (*static_cast<std::map<std::string, std::string>*>(versions))[name] =
        version.empty() ? version_in(loaded.filename().string()) : version;
  }
  return 0;
}

}  // namespace

std::vector<UnloadableModule> unloadable_modules() {
  std::vector<std::string> names = {"inspect", "export", "swatches"};
  for (const Stage& stage : all_stages()) names.push_back(stage.name);
  std::vector<std::filesystem::path> files;
  for (const char* name : {"organbake_contouring.so", "organbake_dicom.so", "organbake_meshes.so",
                           "organbake_video.so"})
    files.push_back(module_folder() / name);
  for (const std::string& name : names) files.push_back(module_file(name));
  std::vector<UnloadableModule> unloadable;
  for (const std::filesystem::path& file : files) {
    // Never closed, as by run_in_module().
    if (::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) continue;
    unloadable.push_back({file.string(), ::dlerror()});
  }
  return unloadable;
}

std::map<std::string, std::string> library_versions() {
  const auto dotted = [](int a, int b, int c) {
    return std::to_string(a) + "." + std::to_string(b) + "." + std::to_string(c);
  };
  std::map<std::string, std::string> versions = {
      {"CGAL", ORGANBAKE_TEXT(CGAL_VERSION)},
      {"OpenEXR", OPENEXR_VERSION_STRING},
      {"OpenSSL", OPENSSL_FULL_VERSION_STR},
      {"libdeflate", LIBDEFLATE_VERSION_STRING},
      {"libpng", PNG_LIBPNG_VER_STRING},
      {"Eigen", dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
      {"nlohmann-json", dotted(NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                               NLOHMANN_JSON_VERSION_PATCH)}};
  ::dl_iterate_phdr(note_library, &versions);
  return versions;
}

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
  const std::string reasons =
      joined(unloadable, "; ", [](const UnloadableModule& module) { return module.reason; });
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
