// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "organbake/geometry/rigid_transform.h"
#include "organbake/player/embedded_types.h"
#include "organbake/player/live_session.h"
#include "organbake/player/player.h"
#include "organbake/warp/view.h"

namespace organbake {

// Where an organ stands in the room of a headset, whose frames are WebXR's: metres, y up, the eyes
// look along −z.
class HeadsetEyes {
 public:
  // The organ as `page` sees it, upright half a metre before whoever wears the headset.
  void place(const Eigen::Matrix4d& room_from_viewer, const View& page,
             const Eigen::Vector3d& center_mm);
  // Of one eye, of a picture of `size` pixels; projection: of any frustum.
  View view(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
            const Eigen::Vector2i& size) const;

 private:
  RigidTransform room_from_world_;  // mm
};

// Thrown where a picture needs maps that were not supplied yet.
struct MapsWanted {
  std::size_t camera;
};

// One organ under somebody's hands, its cameras' maps supplied as they are wanted.
class LiveOrgan {
 public:
  explicit LiveOrgan(Bundle frame);

  void supply(std::size_t camera, std::vector<std::byte> maps);  // throws UsageError
  bool bind_next();                                              // false when all cameras are bound

  // LiveSession::touch(). The first blade has the organ played by its tetrahedra, from rest, until
  // the next reset: springs take a tenth of the time. Throws UsageError for blades where there are
  // none, and before all cameras are bound: what a blade parts is bound anew.
  bool touch(const Eigen::Vector2d& at_px, const InstrumentKind& kind);

  // One time step, or none, and the picture. Throws MapsWanted when the step is done: calling again
  // without one goes on.
  void advance(bool step, int width, int height);
  // A time step without a picture, and what the eyes of a headset see meanwhile.
  void pass_time();
  void stand_before(const Eigen::Matrix4d& room_from_viewer);
  void look(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
            const Eigen::Vector2i& size);
  // Returns how many frames the script has. Throws as play() does, and MapsWanted.
  int play(const std::string& script, int frame);
  const std::uint8_t* pixels() const { return rgba_.data(); }

  // Another solver's state, as Player takes it; then pictures without a step show it.
  void set_state(std::span<const float> xyz_mm, StateOf of);
  void set_state(std::span<const double> xyz_mm, StateOf of);
  EmbeddedPlayer::Mesh mesh() const { return organ_mesh(player_->bundle_now()); }
  // Tools in the next pictures that push nothing, beside those that hands hold.
  void place_tools(const std::vector<EmbeddedPlayer::Tip>& tips);
  std::vector<Eigen::Vector3d> contact_forces(const std::vector<EmbeddedPlayer::Tip>& tips,
                                              bool on_nodes);

  void reset();
  // Who plays the organ from now on, and after resets; what was done is done again under it. Throws
  // UsageError for finite elements where there are no tetrahedra.
  void choose_solver(TissueSolver solver);
  // Throws UsageError for one that the organ cannot be shown in.
  void set_light(DrawnLight light) { drawing_.light = player_->light_for(light); }
  // From now on by WebGL into the canvas whose context the page has made current; returns what
  // draws. Throws GraphicsError, also for software that stands in for graphics hardware, unless
  // that will do. The first picture is held against the processor's.
  std::string draw_by_graphics(bool software_too);
  void draw_by_processor() { player_->draw_by(nullptr); }
  // Why the processor drew the last picture in the graphics hardware's place; else empty.
  const std::string& drawing_note() const { return player_->drawing_note(); }
  void set_background(int red, int green, int blue);
  LiveSession& session() { return *session_; }

  // The kinds of tools, each with the numbers that the next touch gives it.
  std::vector<InstrumentKind>& tools() { return tools_; }

  // What organ_figure() tells: a number by its name in organ.js. This is the only list of them.
  struct Figure {
    const char* name;
    double (*of)(const LiveOrgan&);
  };
  static std::span<const Figure> figures();

 private:
  // What resets bring back, in the place of the usual one.
  std::optional<TissueSolver> chosen_;
  bool has_tetrahedra() const { return player_->bundle().mechanics.body.has_value(); }
  TissueSolver usual_solver() const {
    return has_tetrahedra() ? TissueSolver::fem : TissueSolver::springs;
  }
  void set_solver(TissueSolver solver);
  void take(PlayedFrame played);
  void show(const Frame& frame);
  bool eye_inside() const;

  std::vector<std::vector<std::byte>> supplied_;  // by camera; empty when it is not there, or bound
  bool all_bound_ = false;
  std::unique_ptr<Player> player_;
  std::unique_ptr<LiveSession> session_;
  HeadsetEyes eyes_;
  Frame eye_frame_;  // of the last eye
  DrawOptions drawing_;
  std::vector<InstrumentKind> tools_{instrument_kinds().begin(), instrument_kinds().end()};
  PlayedFrame last_;
  std::vector<std::uint8_t> rgba_;
  std::uint64_t shown_ = 0;  // serial of the frame that they are of
  int recovered_ = 0;
  bool inside_ = false;
};

}  // namespace organbake
