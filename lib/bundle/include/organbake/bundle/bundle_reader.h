// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/image/channel_image.h"

namespace organbake {

// The files of a bundle, wherever they lie: in a folder, or packed into one piece.
class BundleFiles {
 public:
  virtual ~BundleFiles() = default;
  virtual bool has(const std::string& file) const = 0;
  // Checked for their integrity. Both throw BadDataError naming the file.
  virtual std::vector<std::byte> bytes(const std::string& file) const = 0;
  virtual ChannelImage image(const std::string& file) const = 0;  // of base.exr and skin.exr
  virtual std::string where(const std::string& file) const = 0;   // its name in messages
};

// Everything but the maps, which stay empty, checked as BundleReader::read_frame() says.
Bundle read_frame(const BundleFiles& files, Manifest manifest);

// Throws BadDataError for maps with a texel that a renderer must not multiply or index with, the
// first of them named; `folder` is what messages call the camera. faces: of the shell's surface.
void check_maps(const CameraMaps& maps, std::size_t faces, const std::string& folder);

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

struct ResealedBundle {
  Manifest manifest;                 // of the files as they lie there now
  std::vector<std::string> changed;  // against the manifest that lies there; none: nothing to write
};

// Takes over images that were edited by hand: cam_…/color.exr, depth.exr, micro.exr and
// base.exr, of the same size and with the channels that they need. Every check of a bundle is made
// on what lies there now, and where depth or microstructure changed, that both still tell the same
// place: farther apart than a texel is wide, pushed skin would jump. Reads alone; the caller writes
// manifest_to_json(manifest). Throws NoInputError, or BadDataError that names the file: one that is
// missing, not listed, damaged, of another size, or no such image (geometry, cameras and mechanics
// are what the maps were baked for).
ResealedBundle reseal(const std::filesystem::path& folder);

}  // namespace organbake
