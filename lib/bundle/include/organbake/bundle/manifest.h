// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace organbake {

// A bundle with a smooth skin is of version 2, which older players refuse; one without is of
// version 1 and plays as ever.
inline constexpr const char* kBundleSchema = "organbake/bundle/1";
inline constexpr const char* kSkinnedBundleSchema = "organbake/bundle/2";

struct BundleFile {
  std::string path;  // relative, '/'-separated, inside the bundle
  std::uint64_t bytes = 0;
  std::string sha256;
};

struct Manifest {
  std::string name;
  std::string generator;    // program and version
  std::string recipe_json;  // the resolved recipe, an echo without paths of the machine
  std::vector<std::pair<std::string, std::string>> input_hashes;  // role → SHA-256
  std::vector<std::pair<std::string, std::uint64_t>> seeds;
  std::vector<BundleFile> files;    // every file but the manifest, in byte order of path
  std::vector<std::string> edited;  // paths that were changed by hand since the bake
};

// Lists and hashes what lies in `folder` and writes manifest.json there (last, so that a folder
// with a manifest is whole).
void write_manifest(const std::filesystem::path& folder, Manifest manifest);
Manifest manifest_from_json(const std::string& text, const std::string& name);
std::string manifest_to_json(const Manifest& manifest);

}  // namespace organbake
