// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/truth_recorder.h"

#include <cmath>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"
#include "organbake/player/reference_frames.h"
#include "organbake/truth/layer_files.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/truth/truth_tracker.h"
#include "scene_record.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

std::string numbered(int frame) { return "_" + padded(static_cast<std::size_t>(frame), 4); }

}  // namespace

void check_baseline(double baseline_mm) {
  constexpr double kWidest_mm = 1000;
  if (!(std::abs(baseline_mm) <= kWidest_mm && baseline_mm != 0))
    throw UsageError("a baseline of " + to_text(baseline_mm) +
                     " mm makes no stereo; endoscopes have 4 to 6");
}

void TruthOptions::check(std::size_t organs) const {
  if (baseline_mm) check_baseline(*baseline_mm);
  if (!layers.mask) return;
  if (organs > kMostLabelledOrgans || instruments.size() > kMostLabelledTools)
    throw UsageError("a mask has labels for " + std::to_string(kMostLabelledOrgans) +
                     " organs and " + std::to_string(kMostLabelledTools) +
                     " instruments; here are " + std::to_string(organs) + " and " +
                     std::to_string(instruments.size()));
}

View right_eye(const View& view, double baseline_mm) {
  View right = view;
  right.camera.camera_from_world.translation.x() -= baseline_mm;
  return right;
}

struct TruthRecorder::Eye {
  fs::path folder;
  TruthTracker tracker;
  std::shared_ptr<const LensPicture> lens;
  std::function<void(WriteJob)> run;
  CameraSet cameras;
  int frame = -1;  // of the last picture
  Flow backward, forward;
  bool has_backward = false;
  Frame picture;    // of an eye that nobody else draws
  PixelTruth seen;  // through the lens
  Flow drawn_flow;  // before it

  Eye(fs::path where, const TruthOptions& options)
      : folder(std::move(where)), tracker(options.layers), lens(options.lens), run(options.run) {
    if (!run) run = [](const WriteJob& job) { job(); };
  }

  void add(int number, const Player& player, const View& view, const std::vector<Solid>& tools,
           Frame& drawn) {
    tracker.advance(player, view, tools, drawn);
    const LayerSet& layers = tracker.layers();
    if (lens) lens->show(tracker.now(), seen);
    for (WriteJob& job : layer_jobs(folder, "", numbered(number), layers, truth()))
      run(std::move(job));
    if (layers.flow && tracker.has_before()) {
      find_forward();
      put_flow(&forward);
      find_backward();
      has_backward = true;
    }
    frame = number;
    cameras.cameras.push_back(camera_of(view));
    cameras.cameras.back().name = "frame" + numbered(number);
    cameras.images.push_back(frame_file_name(number));
  }
  const PixelTruth& truth() const { return lens ? seen : tracker.now(); }
  PosedCamera camera_of(const View& view) const {
    PosedCamera camera = view.camera;
    if (lens) camera.intrinsics = lens->lens();
    return camera;
  }
  void find_forward() {
    tracker.find_forward(lens ? drawn_flow : forward);
    if (lens) lens->show(drawn_flow, tracker.before(), forward);
  }
  void find_backward() {
    tracker.find_backward(lens ? drawn_flow : backward);
    if (lens) lens->show(drawn_flow, tracker.now(), backward);
  }
  // Of the last picture.
  void put_flow(const Flow* on) const {
    for (WriteJob& job : flow_jobs(folder / ("flow" + numbered(frame) + ".exr"), truth().width,
                                   truth().height, on, has_backward ? &backward : nullptr))
      run(std::move(job));
  }
  // No picture follows on the last one.
  void end() {
    if (frame >= 0 && tracker.layers().flow) put_flow(nullptr);
    tracker.forget();
    has_backward = false;
    frame = -1;
  }
};

TruthRecorder::TruthRecorder(fs::path folder, const TruthOptions& options, const DrawOptions& draw)
    : options_(options), draw_(draw), folder_(std::move(folder)) {
  draw_.keep_bound = true;
  clip_.instruments = options_.instruments;
  clip_.light = draw_.light;
  eyes_.push_back(std::make_unique<Eye>(folder_, options_));
  if (!options_.baseline_mm) return;
  eyes_.push_back(std::make_unique<Eye>(folder_ / "right", options_));
  std::error_code error;
  fs::create_directory(eyes_.back()->folder, error);
  if (error) throw IoError::writing(eyes_.back()->folder, "cannot be created: " + error.message());
}
TruthRecorder::~TruthRecorder() = default;

void TruthRecorder::begin(const TruthClip& clip) {
  for (const auto& eye : eyes_) eye->end();
  clip_ = clip;
  draw_.light = clip.light;
}

void TruthRecorder::add(Player& player, const PlayedScene& scene) {
  const int frame = clip_.first_frame + scene.frame;
  scenes_ +=
      scene_line(frame, eyes_.front()->camera_of(scene.view), scene, player, clip_.instruments);
  eyes_.front()->add(frame, player, scene.view, scene.solids, scene.picture);
  if (!options_.baseline_mm) return;
  Eye& right = *eyes_.back();
  const View view = right_eye(scene.view, *options_.baseline_mm);
  DrawOptions draw = draw_;
  draw.solids = scene.solids;
  if (right.lens) right.lens->prepare(draw);
  player.draw(view, draw, right.picture);
  const auto picture = std::make_shared<Rgb8Image>(right.picture.color);
  if (right.lens) right.lens->show({right.picture, view, rest_bounds(player)}, *picture);
  right.run(
      [expose = clip_.expose_right, frame, picture, file = right.folder / frame_file_name(frame)] {
        constexpr int kQuick = 1;  // PNG level
        if (expose) expose(frame, *picture);
        write_png(file, *picture, kQuick);
      });
  right.add(frame, player, view, scene.solids, right.picture);
}

void TruthRecorder::finish() {
  for (const auto& eye : eyes_) {
    eye->end();
    write_file_atomically(eye->folder / "cameras.json", cameras_to_json(eye->cameras));
  }
  write_file_atomically(folder_ / "scenes.jsonl", scenes_);
}

}  // namespace organbake
