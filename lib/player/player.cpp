// SPDX-License-Identifier: Apache-2.0
#include "player/player.h"

namespace organbake {

Player::Player(const std::filesystem::path& bundle_folder, const DeformOptions& options,
               bool keep_maps)
    : bundle_(BundleReader(bundle_folder).read_all()),
      warper_(bundle_),
      deformer_(bundle_.proxy, bundle_.mechanics, bundle_.base, options) {
  if (!keep_maps) bundle_.maps.clear();  // the bound samples say all that drawing needs
}

}  // namespace organbake
