// SPDX-License-Identifier: GPL-3.0-or-later
#include "libraries.h"

#include <CGAL/version.h>
#include <OpenEXR/OpenEXRConfig.h>
#include <dlfcn.h>
#include <glpk.h>
#include <libdeflate.h>
#include <link.h>
#include <openssl/opensslv.h>
#include <png.h>

#include <Eigen/Core>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "organbake/pipelines/stage.h"
#include "organbake/pipelines/stage_module.h"

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
  std::vector<UnloadableModule> unloadable;
  for (const std::string& name : names) {
    const std::filesystem::path file = module_file(name);
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
      {"GLPK", ORGANBAKE_TEXT(GLP_MAJOR_VERSION) "." ORGANBAKE_TEXT(GLP_MINOR_VERSION)},
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

}  // namespace organbake
