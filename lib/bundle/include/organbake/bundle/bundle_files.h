// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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

}  // namespace organbake
