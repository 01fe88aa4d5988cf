// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/deform/deformer.h"
#include "organbake/instruments/instrument.h"
#include "organbake/player/orbit.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"

namespace organbake {

inline constexpr int kMostScriptFrames = 100000;

// On the orbit, or a pose of the world's. All of a script are of one kind.
struct CameraKeyframe {
  int frame = 0;
  OrbitPose pose;
  std::optional<RigidTransform> camera_from_world = {};
};

// What happens in front of the player's eye, frame by frame. Schema: interaction.schema.json.
struct Script {
  std::string name;
  double time_step_s = 1.0 / 60;
  int frames = 1;
  int width = 0, height = 0;  // 0 = the player's choice
  // What stood for the tissue when it was recorded, and has to again to repeat it.
  std::optional<TissueSolver> solver = {};
  // In which frames cuts part (Player::CutTimes), when it was recorded live; else six steps after
  // the blade.
  std::optional<std::vector<std::uint32_t>> cuts_part_in = {};
  std::optional<DrawnLight> light = {};  // to be seen in; else what the organ is meant for
  std::vector<CameraKeyframe> camera;
  std::optional<Intrinsics> lens = {};  // of the script's size; else virtual camera 0's angle
  // In the keyframes' place: a camera a frame, all of one size, and the file they were read from.
  std::vector<PosedCamera> recorded = {};
  std::string recorded_file = {};
  std::vector<InstrumentPath> instruments;
  // Where another solver has the first organ's vertices, frame by frame, x y z of each; from the
  // first again after the last. Then there are no instruments.
  std::vector<std::vector<double>> vertices_mm = {};
};

// Throws BadDataError naming `name` and the key; NoInputError.
Script script_from_json(const std::string& text, const std::string& name);
Script read_script(const std::filesystem::path& path);
// The document that script_from_json() reads back to the last bit.
std::string script_to_json(const Script& script);

// The keyframes before and behind a frame, and theirs; before the first and after the last a and b
// are the same.
struct KeyframeSpan {
  int before, a, b, after;
  double share;  // of the way from a to b
};
KeyframeSpan keyframes_at(const Script& script, int frame);
double catmull_rom(double before, double a, double b, double after, double t);

// The camera on the orbit at a frame: Catmull–Rom between keyframes, so that it never jerks; held
// at the ends.
OrbitPose camera_at(const Script& script, int frame);

// Plays the script from these cameras instead of its own. Throws UsageError naming `name` for
// distortion, several sizes or fewer cameras than frames. A script without a size takes theirs.
void take_recorded(const CameraSet& cameras, const std::string& name, Script& script);

// Who looks at a frame, in a picture of width × height pixels: intrinsics that were given for
// another size are scaled. Throws UsageError as orbit_view() does.
View view_at(const Script& script, int frame, const CameraSet& cameras, int width, int height);
// A camera's view in another size.
View view_of(const PosedCamera& camera, int width, int height);

// A script's instruments with every waypoint brought to world millimetres.
class InstrumentMotion {
 public:
  // Throws BadDataError, naming the script and the key, where a direction meets no skin.
  InstrumentMotion(const Script& script, const Bundle& bundle);

  std::vector<Instrument> at(double time_s) const;  // InstrumentPath::at() of each
  const std::vector<InstrumentPath>& paths() const { return paths_; }

 private:
  std::vector<InstrumentPath> paths_;
};

}  // namespace organbake
