// SPDX-License-Identifier: GPL-3.0-or-later
// A moving scope's clip to poses, depth and a surface: of the phantom against its truth, of the
// shared video against the points of COLMAP's model, which tell depth up to one scale.
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "bench.h"
#include "measuring/agreement.h"
#include "measuring/programs.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/core/files.h"
#include "organbake/formats/camera_files.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

// What is asked of a clip; percent.
struct Promise {
  std::string what, name;
  std::vector<std::string> phantom;  // options of `phantom --kind laparoscopy`
  bool lens_given;
  double path, depth, covered;
};

// Smaller in a quick run.
fs::path clip_of(const Bench& bench, const Promise& promise) {
  std::vector<std::string> options = promise.phantom;
  if (bench.quick())
    options.insert(options.end(),
                   {"--frames", "60", "--frame-width-px", "640", "--frame-height-px", "360"});
  return make_motion_clip(bench.scratch() / promise.name, options, bench.context());
}

DepthPairs depths_against_truth(const fs::path& found, const fs::path& truth) {
  DepthPairs pairs;
  for (const int frame : frames_with_depth(found / "depth")) {
    const fs::path exr = frame_file(truth, frame, ".exr");
    if (!fs::exists(exr)) continue;
    pairs.add_maps(read_depth(frame_file(found / "depth", frame, ".exr")), read_depth(exr));
  }
  return pairs;
}

// Of what a true frame shows: each pixel's share of the surface, mm².
double area_seen(const fs::path& exr, const Intrinsics& lens) {
  constexpr float kGrazing = 0.1f;  // cosine beyond which a pixel's share means nothing
  const ChannelImage image = read_exr(exr);
  const auto& depth = image.floats("Z", exr.string());
  const auto& nx = image.floats("normal.X", exr.string());
  const auto& ny = image.floats("normal.Y", exr.string());
  const auto& nz = image.floats("normal.Z", exr.string());
  double area = 0;
  for (std::size_t k = 0; k < depth.size(); ++k) {
    if (!std::isfinite(depth[k])) continue;
    const Eigen::Vector3d ray = unproject(lens, {static_cast<double>(k % image.width) + 0.5,
                                                 static_cast<double>(k / image.width) + 0.5});
    const double facing = std::abs(ray.dot(Eigen::Vector3d(nx[k], ny[k], nz[k])));
    if (facing > kGrazing * ray.norm())
      area += double(depth[k]) * depth[k] / (lens.fx * lens.fy * facing);
  }
  return area;
}

void promise_area(Bench& bench, const MotionRun& run, const fs::path& clip, const CameraSet& truth,
                  double scale) {
  const fs::path surface = run.folder / "surface.ply";
  if (!fs::exists(surface)) return bench.skip("area of the surface seen", "no surface.ply");
  double best = 0;
  for (const int frame : frames_with_depth(clip / "truth"))
    best = std::max(best, area_seen(frame_file(clip / "truth", frame, ".exr"),
                                    truth.cameras.at(static_cast<std::size_t>(frame)).intrinsics));
  bench.at_least("clip sideways: area of the surface by what its best frame sees", "×",
                 scale * scale * surface_area(read_ply(surface)) / best, 1.5);
}

void promise_clip(Bench& bench, const Promise& promise) {
  const fs::path frames = clip_of(bench, promise), clip = frames.parent_path();
  bench.now(promise.what);
  const fs::path lens = promise.lens_given ? clip / "cameras.json" : fs::path();
  const fs::path folder = bench.scratch() / (promise.name + (lens.empty() ? "_free" : "_given"));
  const MotionRun run = run_motion(frames, lens, folder, bench.context());
  if (!run.refusal.empty()) return bench.fail(promise.what + ": " + run.refusal);
  const CameraSet truth = read_cameras(clip / "cameras.json");
  const auto path = path_error(read_cameras(run.folder / "cameras.json"), truth);
  const DepthPairs depths = depths_against_truth(run.folder, clip / "truth");
  if (!path || depths.found.empty())
    return bench.fail(promise.what + ": no poses or no depth of frames with a truth");
  const DepthAgreement depth = agreement_of(depths);
  bench.at_most(promise.what + ": camera path error of its extent", "%", path->rms_percent,
                promise.path);
  bench.at_most(promise.what + ": depth, mean relative, one scale for the clip", "%",
                depth.mean_percent, promise.depth);
  bench.at_least(promise.what + ": coverage", "%", depth.covered_percent, promise.covered);
  bench.point(promise.what, "organbake motion", run.timing,
              {{"depth, mean relative", "%", depth.mean_percent},
               {"path", "%", path->rms_percent},
               {"memory", "MB", run.peak_mb}},
              {{"frames posed", "", double(path->frames)}});
  if (promise.name == "slide" && promise.lens_given)
    promise_area(bench, run, clip, truth, path->scale);
}

// Clips of the phantom with their truth: path, depth, area seen.
void promise_motion_of_phantom(Bench& bench) {
  const std::vector<std::string> tour = {"--path", "tour", "--no-instrument"};
  const std::vector<std::string> hard = {"--path",    "tour", "--breathing-mm",        "3",
                                         "--blurred", "0.1",  "--bit-rate-mbit-per-s", "4"};
  promise_clip(bench, {"tour, lens given", "tour", tour, true, 0.5, 1.0, 90});
  promise_clip(bench, {"tour, lens unknown", "tour", tour, false, 1.0, 1.5, 90});
  promise_clip(bench, {"breathing, instrument, blur, H.264", "hard", hard, true, 1.5, 2.5, 80});
  promise_clip(bench, {"clip sideways", "slide", {"--path", "slide"}, true, 0.5, 1.0, 90});
}

const RegisteredPart kMotion(
    "motion", promise_motion_of_phantom,
    "a moving scope's clip to poses, depth and a surface: truth, and COLMAP's points");

constexpr int kEvery = 5;  // frames of the video that COLMAP got
constexpr int kKeyFrames = 10;
constexpr int kCell_px = 8;

// The places in a COLMAP model's points3D.txt.
std::vector<Eigen::Vector3d> read_model_points(const fs::path& model) {
  std::vector<Eigen::Vector3d> places;
  std::istringstream text(read_text_file(model / "points3D.txt"));
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    long id = 0;
    Eigen::Vector3d place;
    if (words >> id >> place.x() >> place.y() >> place.z()) places.push_back(place);
  }
  return places;
}

// The pixel of the whole frame that a pixel of a depth map shows: maps have no distortion, and as
// many pixels of the frame in each of theirs as their sizes say.
Eigen::Vector2d map_pixel(const Eigen::Vector2d& frame_pixel, const Intrinsics& frame_lens,
                          const Intrinsics& map_lens) {
  Intrinsics straight = map_lens;
  straight.fx = frame_lens.fx * map_lens.width / frame_lens.width;
  straight.fy = frame_lens.fy * map_lens.height / frame_lens.height;
  return project(straight, unproject(frame_lens, frame_pixel));
}

// Depth maps of key frames against the model's points, and how much of the field of view they hold.
struct AgainstPoints {
  DepthPairs pairs;
  double covered = 0, field = 0;  // pixels

  void add(const StoredPicture& frame, const PosedCamera& camera, const Plane& depth,
           const std::vector<Eigen::Vector3d>& cloud) {
    Intrinsics map = camera.intrinsics;
    map.cx *= double(depth.width) / map.width, map.cy *= double(depth.height) / map.height;
    map.width = depth.width, map.height = depth.height;
    map.k1 = map.k2 = map.p1 = map.p2 = map.k3 = 0;
    for (const SeenPoint& seen : nearest_points(camera, cloud, kCell_px))
      pairs.add(depth_between(depth, map_pixel(seen.pixel, camera.intrinsics, map)), seen.depth);
    const PreparedFrame prepared = prepare_frame(frame, camera.intrinsics, {});
    for (int y = 0; y < depth.height; ++y)
      for (int x = 0; x < depth.width; ++x) {
        const int column = (2 * x + 1) * prepared.field.width / (2 * depth.width);
        const int row = (2 * y + 1) * prepared.field.height / (2 * depth.height);
        if (!prepared.field.at(column, row)) continue;
        field += 1;
        covered += std::isfinite(depth.at(x, y));
      }
  }
};

AgainstPoints against_points(const fs::path& video, const MotionRun& run, const CameraSet& model,
                             const std::vector<Eigen::Vector3d>& cloud) {
  std::map<int, const PosedCamera*> both;  // frames with depth of which the model knows the pose
  const std::vector<int> with_depth = frames_with_depth(run.folder / "depth");
  for (const PosedCamera& camera : model.cameras) {
    const auto frame = frame_of_name(camera.name);
    if (frame && std::binary_search(with_depth.begin(), with_depth.end(), *frame))
      both[*frame] = &camera;
  }
  const std::size_t step = std::max<std::size_t>(1, both.size() / kKeyFrames);
  AgainstPoints result;
  VideoReader reader(video);
  StoredPicture frame;
  std::size_t seen = 0;
  for (int number = 0; reader.next(frame); ++number) {
    const auto found = both.find(number);
    if (found == both.end() || seen++ % step != 0) continue;
    result.add(frame, *found->second, read_depth(frame_file(run.folder / "depth", number, ".exr")),
               cloud);
  }
  return result;
}

double frames_posed(const CameraSet& set) {
  return double(std::count_if(set.cameras.begin(), set.cameras.end(), [](const PosedCamera& c) {
    const auto frame = frame_of_name(c.name);
    return frame && *frame % kEvery == 0;
  }));
}

void promise_depth(Bench& bench, const fs::path& video, const MotionRun& run,
                   const fs::path& model_folder, const std::string& what) {
  if (!run.refusal.empty()) return bench.fail(what + ": " + run.refusal);
  const CameraSet model = read_camera_file(model_folder);
  const CameraSet found = read_cameras(run.folder / "cameras.json");
  const AgainstPoints against = against_points(video, run, model, read_model_points(model_folder));
  Quantities errors;
  if (!against.pairs.found.empty()) {
    const DepthAgreement depth = agreement_of(against.pairs);
    bench.at_least(what + ": depth against COLMAP's points, Spearman", "", depth.spearman, 0.93);
    bench.at_most(what + ": depth against COLMAP's points, median relative", "%",
                  depth.median_percent, 4);
    bench.at_least(what + ": field of view covered", "%", 100 * against.covered / against.field,
                   85);
    errors.push_back({"depth, median relative", "%", depth.median_percent});
  }
  bench.at_least(what + ": frames posed of every 5th", "", frames_posed(found),
                 double(model.cameras.size()));
  errors.push_back({"memory", "MB", run.peak_mb});
  bench.point("shared video", "organbake motion, " + what, run.timing, errors);
}

void promise_motion_of_video(Bench& bench) {
  if (bench.quick()) return;
  const fs::path video = bench.data("video/laparoscopy_720p_25fps.mp4");
  const fs::path model = bench.data("video/colmap_model");
  if (video.empty() || model.empty()) return;
  for (const bool given : {true, false}) {
    const std::string what = given ? "lens given" : "lens unknown";
    bench.now("the shared video, " + what);
    const fs::path folder = bench.scratch() / (given ? "video_given" : "video_free");
    const MotionRun run = run_motion(video, given ? model : fs::path(), folder, bench.context());
    promise_depth(bench, video, run, model, what);
  }
}

const RegisteredPart kMotionVideo("motion", promise_motion_of_video);

}  // namespace
}  // namespace organbake
