// SPDX-License-Identifier: Apache-2.0
#include "truth_files.h"

#include <filesystem>
#include <string>

#include "core/error.h"
#include "core/files.h"
#include "image/png.h"
#include "player/script_camera.h"
#include "truth/layer_files.h"
#include "truth/truth_tracker.h"

namespace organbake {
namespace fs = std::filesystem;

TruthOptions truth_options(const Command& command, const Script& script, const Player& player) {
  TruthOptions options;
  options.layers = command.layers;
  options.baseline_mm = command.stereo_mm;
  for (const InstrumentPath& instrument : script.instruments)
    options.instruments.push_back(instrument.name);
  options.check(player.organ_count());
  return options;
}

View first_recorded_view(const Command& command) {
  Script one;  // what a recorded sequence must be, it must be for one frame, too
  take_recorded(read_cameras(command.cameras), command.cameras.string(), one);
  if (command.size) one.width = command.size->width, one.height = command.size->height;
  return view_of(one.recorded.front(), one.width, one.height);
}

void write_truth_of_view(const Command& command, Player& player, const View& view,
                         const DrawOptions& options, Frame& frame, const RunContext& context) {
  TruthOptions asked;
  asked.layers = command.layers;
  asked.baseline_mm = command.stereo_mm;
  asked.check(player.organ_count());
  const fs::path folder = command.frame_file.parent_path();
  const std::string stem = command.frame_file.stem().string();
  CameraSet cameras;
  const auto write = [&](const View& from, const std::string& name, Frame& drawn) {
    context.throw_if_cancelled();
    TruthTracker tracker(command.layers);
    tracker.advance(player, from, options.solids, drawn);
    write_layers(folder, name + "_", "", command.layers, tracker.now());
    cameras.cameras.push_back(from.camera);
    cameras.cameras.back().name = name;
    cameras.images.push_back(name + ".png");
  };
  write(view, stem, frame);
  if (command.stereo_mm) {
    const View right = right_eye(view, *command.stereo_mm);
    Frame drawn;
    player.draw(right, options, drawn);
    write_png(folder / (stem + "_right.png"), drawn.color);
    write(right, stem + "_right", drawn);
  }
  write_file_atomically(folder / (stem + "_cameras.json"), cameras_to_json(cameras));
}

}  // namespace organbake
