// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "bundle/bundle.h"
#include "deform/deformer.h"
#include "warp/paper_warp.h"
#include "warp/warper.h"

namespace organbake {

// The interactive phase of the paper (2.2) in one object: load a baked organ, push it about, draw
// it.
//
//   organbake::Player player("out/liver");
//   organbake::Frame frame;
//   player.step({{tip_mm, 5.0, organbake::InstrumentMode::poke, true}});
//   player.draw(view, {}, frame);
//
// One thread calls; drawing uses TBB's threads inside and gives the same bytes for any number.
class Player {
 public:
  // Binds a bundle's samples; keep_maps holds on to the camera maps for comparisons.
  explicit Player(Bundle bundle, const DeformOptions& options = {}, bool keep_maps = false);
  // Reads the bundle but for its maps: a camera's are read, checked and bound when a view first
  // needs them, and draw() throws what is wrong with them. keep_maps reads all at once. Throws
  // NoInputError or BadDataError naming the file.
  explicit Player(const std::filesystem::path& bundle_folder, const DeformOptions& options = {},
                  bool keep_maps = false);
  // Reads all cameras now, or from a thread of its own while frames are drawn, so that turning the
  // view never waits. Frames are the same either way.
  void load_all() { warper_.bind_all(); }
  void load_ahead() { warper_.bind_ahead(); }

  StepReport step(const std::vector<InstrumentTip>& tips) { return deformer_.step(tips); }
  // The paper's own warp needs a player that keeps its maps, and throws UsageError otherwise.
  DrawReport draw(const View& view, const DrawOptions& options, Frame& frame);
  bool can_relight() const { return warper_.can_relight(); }  // DrawOptions::relight
  // Back to rest.
  void reset() { deformer_.reset(); }

  const Bundle& bundle() const { return bundle_; }
  const std::vector<Eigen::Vector3d>& proxy_positions() const { return deformer_.positions(); }

 private:
  Player(const BundleReader& reader, const DeformOptions& options);

  Bundle bundle_;
  Warper warper_;
  Deformer deformer_;
  std::unique_ptr<PaperWarp> paper_;  // made when first asked for
};

}  // namespace organbake
