// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "bench.h"
#include "measuring/depth_agreement.h"
#include "measuring/motion_run.h"
#include "measuring/path_alignment.h"
#include "organbake/bundle/cameras_json.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"

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
               {"turn", "°", path->turn_deg},
               {"memory", "MB", run.peak_mb}},
              {{"frames posed", "", double(path->frames)}});
  if (promise.name == "slide" && promise.lens_given)
    promise_area(bench, run, clip, truth, path->truth_from_found.scale);
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
    "a moving scope's clip to poses, depth and a surface: truth, and COLMAP beside it");

}  // namespace
}  // namespace organbake
