// SPDX-License-Identifier: Apache-2.0
// Writes the truth of frames: by frame the layers as EXR and PNG files of narrow numbers, which
// whoever calls may write later, and a line of JSON of what lies behind the frame; for the sequence
// the cameras.
#include "organbake/truth/truth_recorder.h"

#include <cmath>
#include <utility>

#include "organbake/bundle/cameras_json.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/exr.h"
#include "organbake/image/png.h"
#include "skin_tracks.h"

namespace organbake {
namespace {

constexpr int kQuick = 1;  // level: layers are large and many

template <class Value, class Of>
Channel plane(std::string name, std::size_t pixels, Of&& of, bool half = false) {
  std::vector<Value> values(pixels);
  for (std::size_t i = 0; i < pixels; ++i) values[i] = of(i);
  return {std::move(name), std::move(values), half};
}

WriteJob exr_job(const std::filesystem::path& file, int width, int height,
                 std::vector<Channel> channels, ExrCompression compression = ExrCompression::zip) {
  // Shared: a std::function copies what it holds.
  const auto image = std::make_shared<ChannelImage>();
  image->width = width, image->height = height, image->channels = std::move(channels);
  return [file, image, compression] {
    write_exr(file, *image, {.compression = compression, .zip_level = kQuick});
  };
}

std::vector<Channel> id_channels(const PixelTruth& t) {
  const std::size_t n = t.pixels();
  // Tools hide the skin.
  const auto shown = [&](std::size_t i) { return t.solid_at(i) == 0 && t.bound[i].has_skin(); };
  const auto number = [&](std::string name, float BoundPixel::*member) {
    return plane<float>(std::move(name), n,
                        [&](std::size_t i) { return shown(i) ? t.bound[i].*member : 0; });
  };
  const auto organ = [&](std::size_t i) { return shown(i) ? t.organ_at(i) : 0; };
  const auto face = [&](std::size_t i) { return shown(i) ? t.bound[i].face : BoundPixel::kNoSkin; };
  return {plane<std::uint32_t>("organ", n, organ), plane<std::uint32_t>("face", n, face),
          number("b1", &BoundPixel::b1), number("b2", &BoundPixel::b2),
          number("h", &BoundPixel::height_mm)};
}

// Finer than flow is known, and bits that say nothing need not be packed.
float rounded(float px) {
  constexpr float kSteps = 256;
  return std::nearbyint(px * kSteps) / kSteps;
}

// As halves, which are as exact as flow is known up to 50 px or so.
void add_flow(const std::string& name, const Flow* flow, std::vector<Channel>& channels) {
  if (!flow) return;
  const std::size_t n = flow->px.size();
  for (int k = 0; k < 2; ++k)
    channels.push_back(plane<float>(
        name + (k == 0 ? ".x" : ".y"), n, [&](std::size_t i) { return rounded(flow->px[i][k]); },
        true));
  channels.push_back(plane<float>(
      name + ".seen", n, [&](std::size_t i) { return float(flow->seen[i]); }, true));
}

}  // namespace

std::vector<WriteJob> layer_jobs(const std::filesystem::path& folder, const std::string& before,
                                 const std::string& after, const LayerSet& layers,
                                 const PixelTruth& t) {
  const std::size_t n = t.pixels();
  std::vector<WriteJob> jobs;
  const auto exr = [&](const char* layer, std::vector<Channel> channels,
                       ExrCompression compression = ExrCompression::zip) {
    jobs.push_back(exr_job(folder / (before + layer + after + ".exr"), t.width, t.height,
                           std::move(channels), compression));
  };
  // To 16 of a depth's bits: finer than it is known.
  if (layers.depth) exr("depth", {{"Z", t.depth_mm}}, ExrCompression::pxr24);
  if (layers.normals) {
    std::vector<Channel> channels;
    for (int k = 0; k < 3; ++k)
      channels.push_back(plane<float>(
          std::string(1, "XYZ"[k]), n, [&](std::size_t i) { return t.normal[i][k]; }, true));
    exr("normals", std::move(channels));
  }
  if (layers.mask)
    jobs.push_back([file = folder / (before + "mask" + after + ".png"), width = t.width,
                    height = t.height, label = t.label] {
      write_file_atomically(file, encode_grey_png(width, height, std::span(label), kQuick));
    });
  if (layers.id) exr("id", id_channels(t));
  if (layers.weight)
    exr("weight", {plane<float>(
                      "weight", n, [&](std::size_t i) { return t.bound[i].weight; }, true)});
  return jobs;
}

namespace {

// flow as EXR: forward.x forward.y forward.seen and backward likewise, px to 1/256 as half floats
// (to one part in 4096), and 0 or 1; of a picture that is the first or the last one of the two is
// missing; without both there is no file.
std::vector<WriteJob> flow_jobs(const std::filesystem::path& file, int width, int height,
                                const Flow* forward, const Flow* backward) {
  std::vector<Channel> channels;
  add_flow("forward", forward, channels);
  add_flow("backward", backward, channels);
  if (channels.empty()) return {};
  return {exr_job(file, width, height, std::move(channels))};
}

Json camera_json(const PosedCamera& camera) {
  Json pose = Json::array();
  for (int row = 0; row < 3; ++row) {
    const auto& r = camera.camera_from_world.rotation;
    pose.push_back({r(row, 0), r(row, 1), r(row, 2), camera.camera_from_world.translation[row]});
  }
  Json json = intrinsics_to_json(camera.intrinsics);
  json["camera_from_world"] = pose;
  return json;
}

Json instruments_json(const PlayedScene& scene, const std::vector<std::string>& names) {
  Json all = Json::array();
  for (std::size_t i = 0; i < scene.instruments.size(); ++i) {
    const Instrument& tip = scene.instruments[i];
    Json json = Json::object();
    json["name"] = i < names.size() ? names[i] : "instrument " + std::to_string(i);
    json["label"] = kFirstToolLabel + i;
    json["active"] = tip.active;
    json["mode"] = mode_of(tip.kind);
    json["position_mm"] = to_json(tip.position_mm);
    json["axis_mm"] = to_json(tip.axis_mm);
    json["radius_mm"] = tip.radius_mm;
    if (const Scissors* scissors = std::get_if<Scissors>(&tip.kind))
      json["opening_mm"] = to_json(scissors->opening_mm);
    json["force_n"] = to_json(scene.step.tip_force_n.at(i));
    all.push_back(json);
  }
  return all;
}

Json contacts_json(const StepReport& step) {
  Json all = Json::array();
  for (const ContactPoint& point : step.contact_points)
    all.push_back({{"instrument", point.instrument},
                   {"organ", point.organ},
                   {"position_mm", to_json(point.position_mm)},
                   {"normal", to_json(point.normal)},
                   {"force_n", to_json(point.force_n)},
                   {"depth_mm", point.depth_mm},
                   {"carried", point.carried}});
  return all;
}

Json proxies_json(const Player& player) {
  Json organs = Json::array();
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    Json vertices = Json::array();
    for (const Eigen::Vector3d& v : player.proxy_positions(o)) vertices.push_back(to_json(v));
    organs.push_back(std::move(vertices));
  }
  return organs;
}

// One line of JSON, with its newline, of what lies behind a frame: its number, its time, the camera
// (px, mm; of the picture that was written), each instrument (mm, N, whether it is there), the
// points of its skin that they touch (mm, unit normals, N), how many contacts there were, and where
// the vertices of each organ's proxy lie (world mm).
std::string scene_line(int frame, const PosedCamera& camera, const PlayedScene& scene,
                       const Player& player, const std::vector<std::string>& instrument_names) {
  const Json json = {{"frame", frame},
                     {"time_s", scene.time_s},
                     {"camera", camera_json(camera)},
                     {"instruments", instruments_json(scene, instrument_names)},
                     {"contacts", scene.step.contacts},
                     {"contact_points", contacts_json(scene.step)},
                     {"tissue_contacts", scene.step.tissue_contacts},
                     {"tool_contacts", scene.step.tool_contacts},
                     {"penetration_mm", scene.step.penetration_mm},
                     {"proxy_mm", proxies_json(player)}};
  return json.dump() + "\n";
}

namespace fs = std::filesystem;

std::string numbered(int frame) { return "_" + padded(static_cast<std::size_t>(frame), 4); }

}  // namespace

void check_baseline(double baseline_mm) {
  if (!(baseline_mm >= kNarrowestBaseline_mm && baseline_mm <= kWidestBaseline_mm))
    throw UsageError("a baseline of " + to_text(baseline_mm) +
                     " mm makes no stereo; endoscopes have 4 to 6, and " +
                     to_text(kNarrowestBaseline_mm) + " to " + to_text(kWidestBaseline_mm) +
                     " are drawn");
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

namespace {

// Points are followed as flow is found.
LayerSet with_flow_for(int tracks, LayerSet layers) {
  layers.flow |= tracks > 0;
  return layers;
}

}  // namespace

struct TruthRecorder::Eye {
  fs::path folder;
  LayerSet layers;
  SkinTracks tracks;
  TruthTracker tracker;
  std::shared_ptr<const LensPicture> lens;
  std::function<void(WriteJob)> run;
  CameraSet cameras;
  int frame = -1;       // of the last picture
  int first_frame = 0;  // of its clip
  Flow backward, forward;
  bool has_backward = false;
  Frame picture;    // of an eye that nobody else draws
  PixelTruth seen;  // through the lens
  Flow drawn_flow;  // before it

  Eye(fs::path where, const TruthOptions& options)
      : folder(std::move(where)),
        layers(options.layers),
        tracks(options.tracks),
        tracker(with_flow_for(options.tracks, layers)),
        lens(options.lens),
        run(options.run) {
    if (!run) run = [](const WriteJob& job) { job(); };
  }

  void add(int number, const Player& player, const View& view, const std::vector<Solid>& tools,
           Frame& drawn) {
    tracker.advance(player, view, tools, drawn);
    if (lens) lens->show(tracker.now(), seen);
    for (WriteJob& job : layer_jobs(folder, "", numbered(number), layers, truth()))
      run(std::move(job));
    if (layers.flow && tracker.has_before()) {
      find_forward();
      put_flow(&forward);
      find_backward();
      has_backward = true;
    }
    tracks.add(tracker, lens.get(), truth());
    if (frame < 0) first_frame = number;
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
    if (frame >= 0 && layers.flow) put_flow(nullptr);
    if (auto npz = tracks.take())
      run([file = folder / ("tracks" + numbered(first_frame) + ".npz"), bytes = std::move(*npz)] {
        write_file_atomically(file, bytes);
      });
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
