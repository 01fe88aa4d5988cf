// SPDX-License-Identifier: Apache-2.0
#pragma once

// What a run writes: pictures as they are shown, the truth beside them, and its results.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "command.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/run_context.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/truth_recorder.h"
#include "organbake/warp/view.h"

namespace organbake {

// What is written of a drawn frame: the frame as it is or as a scope's lens shows it, and beside
// it, where two eyes are asked for, the picture of the right one.
class ShownPicture {
 public:
  ShownPicture(Player& player, std::shared_ptr<const LensPicture> lens,
               std::optional<double> eyes_mm);

  // Pixels that it is wide, of a view that is `width`.
  int width_of(int width) const { return eyes_mm_ ? 2 * width : width; }
  // Until the next one. `options` are the frame's, its tools among them.
  const Rgb8Image& of(const Frame& frame, const View& view, const DrawOptions& options);

 private:
  const Rgb8Image& through_lens(const Frame& frame, const View& view, Rgb8Image& seen) const;

  Player& player_;
  std::shared_ptr<const LensPicture> lens_;
  std::optional<double> eyes_mm_;
  Bounds organs_;  // at rest
  Frame right_frame_;
  Rgb8Image left_, right_, both_;
};

// From --layers and --stereo, checked.
TruthOptions truth_options(const Command& command, const Script& script, const Player& player,
                           std::shared_ptr<const LensPicture> lens);

// Of --scope, for pictures of that size; nothing without one.
std::shared_ptr<const LensPicture> lens_picture(const Command& command, const DrawOptions& options,
                                                int width, int height);

// --cameras; their distortion is left out where --scope stands in its place.
CameraSet recorded_cameras(const Command& command);

// The first camera of --cameras, in --size or its own.
View first_recorded_view(const Command& command);

// The layers, the right eye and cameras.json of one view, beside its picture: for picture.png
// picture_depth.exr, picture_right.png, picture_right_depth.exr, picture_cameras.json and so on.
// frame: the view, drawn with its bound pixels kept. lens: may be empty.
void write_truth_of_view(const Command& command, Player& player, const View& view,
                         const LensPicture* lens, const DrawOptions& options, Frame& frame,
                         const RunContext& context);

// What a run prints on stdout: its results as lines, one by one as they come, or under --json one
// object in the end.
class Results {
 public:
  explicit Results(bool as_json) : as_json_(as_json) {}

  void wrote(const std::string& option, const std::filesystem::path& path);
  // A result under a key; `text` is what stands for it among the lines.
  void add(const std::string& key, Json value, const std::string& text);
  // Throws IoError when stdout doesn't take it, as the others do.
  void finish() const;

 private:
  bool as_json_;
  Json object_ = Json::object();
};

// Throws IoError for a result that lies in one of the bundles.
void check_apart_from_bundles(const std::filesystem::path& path, const Command& command);

// Says before any work what would keep a result from being written at its end, and refuses results
// that would overwrite what the command reads. Throws UsageError or IoError.
void check_outputs(const Command& command);

}  // namespace organbake
