// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// Opens a bundle, trusting nothing: sizes, paths, hashes, counts, NaN. Every file that is read is
// checked against the manifest's size and SHA-256 first. Throws NoInputError or BadDataError that
// name the file.
class BundleReader {
 public:
  explicit BundleReader(std::filesystem::path folder);
  // Against another manifest than the one that lies there.
  BundleReader(std::filesystem::path folder, Manifest manifest)
      : folder_(std::move(folder)), manifest_(std::move(manifest)) {}

  const std::filesystem::path& folder() const { return folder_; }
  const Manifest& manifest() const { return manifest_; }
  bool has(const std::string& file) const;
  // The checked bytes of one listed file.
  std::vector<std::byte> read(const std::string& file) const;
  // Whatever lies there under its name.
  std::vector<std::byte> read_unchecked(const std::string& file) const;

  // Everything but the maps (they stay empty).
  Bundle read_frame() const;
  // lens: the camera's; faces: how many the shell's surface has. Thread-safe.
  CameraMaps read_maps(std::size_t camera, const Intrinsics& lens, std::size_t faces) const;
  // The whole bundle; maps are read in parallel.
  Bundle read_all() const;
  // The baked surface with its colours, when the bundle carries one ("surface.ply").
  TriangleMesh read_surface() const;

  // Checks every listed file, and that nothing unlisted lies in the folder.
  void verify() const;

 private:
  std::filesystem::path folder_;
  Manifest manifest_;
};

}  // namespace organbake
