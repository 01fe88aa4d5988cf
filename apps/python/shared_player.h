// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "organbake/player/embedded_player.h"
#include "organbake/player/held_tools.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/truth/batch_drawing.h"
#include "organbake/truth/flow.h"
#include "organbake/truth/truth_tracker.h"

namespace organbake {

// One picture and what was asked for beside it.
struct DrawnPicture {
  Rgb8Image color;
  LayerSet layers;
  PixelTruth truth;
  bool has_flow = false;
  Flow backward, forward;  // from this picture to the last one, and from that to this
};

using StateNumbers = decltype(StateBatch::xyz_mm);

// A player that several threads may call, one after the other: without the interpreter's lock,
// which no call needs. Throws what Player throws, and UsageError once it was closed.
class SharedPlayer {
 public:
  SharedPlayer(const std::vector<std::filesystem::path>& bundles, const DeformOptions& options,
               std::optional<DrawnLight> light);

  StepReport step(const std::vector<Instrument>& instruments);
  void place_tools(const std::vector<Instrument>& instruments);  // for pictures alone
  void reset();
  void close();
  View orbit(const OrbitPose& pose, int width, int height);
  // With the tools of the last step, if they are wanted. `pixels`: room for the picture in the
  // caller's memory instead of the result's own, or nullptr.
  DrawnPicture draw(const View& view, const LayerSet& layers, bool tools, std::uint8_t* pixels);
  std::size_t organ_count();
  std::vector<Eigen::Vector3d> proxy_positions(std::size_t organ);
  std::vector<Face> proxy_faces(std::size_t organ);
  void set_state(const StateNumbers& xyz_mm, StateOf of, std::size_t organ);
  EmbeddedPlayer::Mesh mesh(std::size_t organ);
  std::vector<Eigen::Vector3d> contact_forces(const std::vector<Instrument>& instruments,
                                              std::size_t organ, bool on_nodes);
  void draw_many(const StateBatch& states, const std::vector<View>& views,
                 const BatchPlanes& planes);
  Eigen::Vector3d skin_point(const Eigen::Vector3d& direction);

 private:
  Player& open();  // with the lock held

  std::mutex mutex_;
  std::unique_ptr<Player> player_;
  std::optional<DrawnLight> light_;
  std::vector<Instrument> instruments_;  // of the last step, where they were held
  double time_step_s_, time_s_ = 0;      // passed since it was loaded
  std::optional<HeldTools> tools_;       // once they were drawn
  Frame frame_;
  std::optional<TruthTracker> tracker_;
  std::optional<BatchDrawing> batch_;  // once many were drawn
};

}  // namespace organbake
