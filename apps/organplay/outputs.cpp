// SPDX-License-Identifier: Apache-2.0
// What a run of organplay leaves behind: pictures, each as a scope or two eyes show it, files of
// truth, and results as lines or JSON. What is in the way is said before anything is made.
#include "organplay.h"

#include <fcntl.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/geometry/camera.h"
#include "organbake/image/png.h"
#include "organbake/image/video_pipe.h"

namespace organbake {
ShownPicture::ShownPicture(Player& player, std::shared_ptr<const LensPicture> lens,
                           std::optional<double> eyes_mm)
    : player_(player), lens_(std::move(lens)), eyes_mm_(eyes_mm), organs_(rest_bounds(player)) {}

const Rgb8Image& ShownPicture::of(const Frame& frame, const View& view,
                                  const DrawOptions& options) {
  const Rgb8Image& left = through_lens(frame, view, left_);
  if (!eyes_mm_) return left;
  const View right = right_eye(view, *eyes_mm_);
  player_.draw(right, options, right_frame_);
  both_ = side_by_side(left, through_lens(right_frame_, right, right_));
  return both_;
}

const Rgb8Image& ShownPicture::through_lens(const Frame& frame, const View& view,
                                            Rgb8Image& seen) const {
  if (!lens_) return frame.color;
  lens_->show({frame, view, organs_}, seen);
  return seen;
}

namespace fs = std::filesystem;

std::shared_ptr<const LensPicture> lens_picture(const Command& command, const DrawOptions& options,
                                                int width, int height) {
  if (command.lens.empty()) return nullptr;
  ScopeLens lens = read_scope_lens(command.lens).in_size(width, height);
  lens.picture.surroundings |= command.cavity && options.light == DrawnLight::scope;
  return std::make_shared<const LensPicture>(lens, command.lens.string());
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
    for (const WriteJob& job :
         layer_jobs(folder, name + "_", "", command.layers, lens ? seen : tracker.now()))
      job();
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

void Results::wrote(const std::string& option, const std::filesystem::path& path) {
  add(option, path.string(), path.string() + "\n");
}

void Results::add(const std::string& key, Json value, const std::string& text) {
  if (as_json_) {
    object_[key] = std::move(value);
  } else if (!text.empty()) {
    write_to_stdout(text);
  }
}

void Results::finish() const {
  if (!as_json_) return;
  // A comparison is a document of its own.
  const auto comparison = object_.find("comparison");
  const bool alone = object_.size() == 1 && comparison != object_.end();
  write_to_stdout(json_text(alone ? *comparison : object_));
}

namespace {
namespace fs = std::filesystem;

struct Output {
  const char* option;
  fs::path file;
  std::vector<std::string> endings;
};

std::string any_of(const std::vector<std::string>& endings) {
  std::string text = endings.front();
  for (std::size_t i = 1; i < endings.size(); ++i)
    text += (i + 1 < endings.size() ? ", " : " or ") + endings[i];
  return text;
}

void check_ending(const Output& output) {
  const auto& endings = output.endings;
  if (std::find(endings.begin(), endings.end(), lower_ending(output.file)) != endings.end()) return;
  throw UsageError(std::string(output.option) + " " + output.file.string() + ": is written as " +
                   any_of(endings) + "; give it that ending");
}

void check_writable(const fs::path& folder) {
  // What may be written is not what can be: one tries.
  std::string probe = (folder / ".organplay-XXXXXX").string();
  if (::mkdtemp(probe.data()) == nullptr)
    throw IoError::writing(
        folder, "cannot be written to: " + std::string(std::strerror(errno)) + "; name another");
  ::rmdir(probe.c_str());
}

void check_place(const fs::path& file) {
  const fs::path folder = fs::absolute(file_to_write(file)).parent_path();
  std::error_code error;
  if (!fs::is_directory(folder, error) && error != std::errc::permission_denied)
    throw IoError::writing(folder, "there is no such folder; make it");
  check_writable(folder);
}

// Frames and what is written beside them.
bool is_of_frames(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  if (name == "right" && entry.is_directory()) {
    return std::all_of(fs::directory_iterator(entry.path()), fs::directory_iterator(),
                       is_of_frames);
  }
  if (name == "cameras.json" || name == "scenes.jsonl") return true;
  std::vector<std::string> kinds = layer_names();
  kinds.push_back("frame");
  return (name.ends_with(".png") || name.ends_with(".exr")) &&
         std::any_of(kinds.begin(), kinds.end(),
                     [&](const std::string& kind) { return name.starts_with(kind + "_"); });
}

// A folder of frames may be replaced by new frames; anything else is the user's.
void check_replaceable(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw IoError::writing(folder, "is a file; name another folder");
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_of_frames(entry)) continue;
    throw IoError::writing(folder, "holds '" + entry.path().filename().string() +
                                       "', which is no frame of mine; name another folder");
  }
}

// The folder, made anew with what is missing of the way to it, or put in the place of older frames.
void check_folder(const fs::path& named) {
  fs::path folder = fs::absolute(named).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "out/" names the folder "out"
  std::error_code error;
  const auto missing = [&error](const fs::path& path) {
    return !fs::exists(path, error) && !error && path.has_relative_path();
  };
  fs::path parent = folder.parent_path();
  while (missing(parent)) parent = parent.parent_path();
  if (fs::exists(parent, error) && !fs::is_directory(parent, error))
    throw IoError::writing(parent, "is a file; name another folder");
  check_writable(parent);
  if (!fs::exists(folder)) return;
  check_replaceable(folder);
  check_writable(folder);  // or what was in it could not be removed
}

// Whether it is there or not, or behind a folder that we may not look into.
fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(path), error);
  return error ? fs::absolute(path).lexically_normal() : real;
}

// Whether the path, there or not, lies in the folder or is it.
bool lies_in(const fs::path& path, const fs::path& folder) {
  const fs::path way = real(path).lexically_relative(real(folder));
  return !way.empty() && *way.begin() != "..";
}

// The next run would find it among the frames that it is to replace.
void check_apart_from_frames(const Output& output, const Command& command) {
  const fs::path& frames = command.out_folder;
  if (frames.empty() || !lies_in(output.file, frames)) return;
  throw UsageError(std::string(output.option) + " " + output.file.string() + ": lies in --out " +
                   frames.string() + ", which is for frames alone; put it beside that folder");
}

bool same(const fs::path& a, const fs::path& b) {
  return !a.empty() && !b.empty() && real(a) == real(b);
}

}  // namespace

void check_apart_from_bundles(const fs::path& path, const Command& command) {
  for (const fs::path& bundle : command.bundles) {
    if (lies_in(path, bundle))
      throw IoError::writing(path, "lies in the bundle " + bundle.string() +
                                       ", which would be damaged; name another place");
  }
}

void check_outputs(const Command& command) {
  std::vector<Output> outputs = {{"-o", command.frame_file, {".png"}},
                                 {"--sheet", command.sheet, {".png"}},
                                 {"--report", command.report, {".json"}},
                                 {"--video", command.video, VideoPipe::endings()}};
  std::erase_if(outputs, [](const Output& output) { return output.file.empty(); });
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Output& output = outputs[i];
    check_ending(output);
    check_apart_from_frames(output, command);
    check_place(output.file);
    check_apart_from_bundles(output.file, command);
    if (same(output.file, command.script))
      throw UsageError(std::string(output.option) + " " + output.file.string() +
                       ": is the script itself; name another file");
    for (std::size_t k = 0; k < i; ++k) {
      if (same(output.file, outputs[k].file))
        throw UsageError(std::string(outputs[k].option) + " and " + output.option +
                         " name the same file; name two");
    }
  }
  if (command.out_folder.empty()) return;
  check_apart_from_bundles(command.out_folder, command);
  check_folder(command.out_folder);
}

}  // namespace organbake
