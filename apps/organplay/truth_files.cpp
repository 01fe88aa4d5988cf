// SPDX-License-Identifier: Apache-2.0
#include "truth_files.h"

#include <filesystem>
#include <string>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/png.h"
#include "organbake/player/script_camera.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/truth/truth_recorder.h"

namespace organbake {
namespace fs = std::filesystem;

std::shared_ptr<const LensPicture> lens_picture(const Command& command, int width, int height) {
  if (command.lens.empty()) return nullptr;
  return std::make_shared<const LensPicture>(read_scope_lens(command.lens).in_size(width, height),
                                             command.lens.string());
}

TruthOptions truth_options(const Command& command, const Script& script, const Player& player,
                           std::shared_ptr<const LensPicture> lens) {
  TruthOptions options;
  options.layers = command.layers;
  options.baseline_mm = command.stereo_mm;
  options.lens = std::move(lens);
  for (const InstrumentPath& instrument : script.instruments)
    options.instruments.push_back(instrument.name);
  options.check(player.organ_count());
  return options;
}

CameraSet recorded_cameras(const Command& command) {
  CameraSet set = read_cameras(command.cameras);
  if (command.lens.empty()) return set;
  for (PosedCamera& camera : set.cameras) camera.intrinsics = pinhole_of(camera.intrinsics);
  return set;
}

View first_recorded_view(const Command& command) {
  Script one;  // what a recorded sequence must be, it must be for one frame, too
  take_recorded(recorded_cameras(command), command.cameras.string(), one);
  if (command.size) one.width = command.size->width, one.height = command.size->height;
  return view_of(one.recorded.front(), one.width, one.height);
}

void write_truth_of_view(const Command& command, Player& player, const View& view,
                         const LensPicture* lens, const DrawOptions& options, Frame& frame,
                         const RunContext& context) {
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
    PixelTruth seen;
    if (lens) lens->show(tracker.now(), seen);
    write_layers(folder, name + "_", "", command.layers, lens ? seen : tracker.now());
    cameras.cameras.push_back(from.camera);
    if (lens) cameras.cameras.back().intrinsics = lens->lens();
    cameras.cameras.back().name = name;
    cameras.images.push_back(name + ".png");
  };
  write(view, stem, frame);
  if (command.stereo_mm) {
    const View right = right_eye(view, *command.stereo_mm);
    Frame drawn;
    player.draw(right, options, drawn);
    Rgb8Image shown;
    if (lens) lens->show({drawn, right, rest_bounds(player)}, shown);
    write_png(folder / (stem + "_right.png"), lens ? shown : drawn.color);
    write(right, stem + "_right", drawn);
  }
  write_file_atomically(folder / (stem + "_cameras.json"), cameras_to_json(cameras));
}

}  // namespace organbake
