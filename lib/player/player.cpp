// SPDX-License-Identifier: Apache-2.0
#include "player/player.h"

#include <utility>

namespace organbake {

Player::Player(Bundle bundle, const DeformOptions& options, bool keep_maps)
    : bundle_(std::move(bundle)),
      warper_(bundle_),
      deformer_(bundle_.proxy, bundle_.mechanics, bundle_.base, options) {
  if (!keep_maps) bundle_.maps.clear();  // the bound samples say all that drawing needs
}

Player::Player(const BundleReader& reader, const DeformOptions& options)
    : bundle_(reader.read_frame()),
      warper_(bundle_,
              [reader, cameras = bundle_.cameras.cameras, faces = bundle_.proxy.faces.size()](
                  std::size_t c) { return reader.read_maps(c, cameras[c].intrinsics, faces); }),
      deformer_(bundle_.proxy, bundle_.mechanics, bundle_.base, options) {
  bundle_.maps.clear();
}

DrawReport Player::draw(const View& view, const DrawOptions& options, Frame& frame) {
  if (options.method == WarpMethod::bound) {
    return warper_.draw(deformer_.positions(), view, options, frame);
  }
  if (!paper_) paper_ = std::make_unique<PaperWarp>(bundle_);
  return paper_->draw(bundle_, deformer_.positions(), view, options, frame);
}

Player::Player(const std::filesystem::path& bundle_folder, const DeformOptions& options,
               bool keep_maps)
    : Player(keep_maps ? Player(BundleReader(bundle_folder).read_all(), options, true)
                       : Player(BundleReader(bundle_folder), options)) {}

}  // namespace organbake
