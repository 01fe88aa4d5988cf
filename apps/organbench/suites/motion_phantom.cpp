// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/geometry/ply.h"
#include "organbake/image/exr.h"
#include "organbake/pipelines/worker_process.h"
#include "path_alignment.h"
#include "suites/motion_parts.h"

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

fs::path make_clip(Bench& bench, const std::string& name, const std::vector<std::string>& options) {
  const fs::path folder = bench.scratch() / name;
  if (fs::exists(folder)) return folder;
  bench.now("making the clip " + name);
  std::vector<std::string> command = {
      program_folder() / "organbake", "phantom", "--kind", "laparoscopy", "--quiet", "-o", folder};
  command.insert(command.end(), options.begin(), options.end());
  if (bench.quick())
    command.insert(command.end(),
                   {"--frames", "60", "--frame-width", "640", "--frame-height", "360"});
  run_worker(command, bench.scratch() / "phantom.out", bench.scratch() / "phantom.log",
             bench.context());
  return folder;
}

fs::path frames_of(const fs::path& clip) {
  const fs::path video = clip / "clip.mp4";
  return fs::exists(video) ? video : clip / "frames";
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
  bench.add(Figure{"clip sideways: area of the surface by what its best frame sees", "×",
                   scale * scale * surface_area(read_ply(surface)) / best, 1.5,
                   Figure::Goal::at_least});
}

void promise_clip(Bench& bench, const Promise& promise) {
  const fs::path clip = make_clip(bench, promise.name, promise.phantom);
  bench.now(promise.what);
  const fs::path lens = promise.lens_given ? clip / "cameras.json" : fs::path();
  const MotionRun run =
      run_motion(bench, frames_of(clip), lens, promise.name + (lens.empty() ? "_free" : "_given"));
  if (!run.refusal.empty()) return bench.fail(promise.what + ": " + run.refusal);
  const CameraSet truth = read_cameras(clip / "cameras.json");
  const auto path = path_error(read_cameras(run.folder / "cameras.json"), truth);
  const DepthPairs depths = depths_against_truth(run.folder, clip / "truth");
  if (!path || depths.found.empty())
    return bench.fail(promise.what + ": no poses or no depth of frames with a truth");
  const DepthAgreement depth = agreement_of(depths);
  bench.add(Figure{promise.what + ": camera path error of its extent", "%", path->rms_percent,
                   promise.path});
  bench.add(Figure{promise.what + ": depth, mean relative, one scale for the clip", "%",
                   depth.mean_percent, promise.depth});
  bench.add(Figure{promise.what + ": coverage", "%", depth.covered_percent, promise.covered,
                   Figure::Goal::at_least});
  bench.add(Point{promise.what,
                  "organbake motion",
                  false,
                  {{"frames posed", "", double(path->frames)}},
                  run.timing,
                  {{"depth, mean relative", "%", depth.mean_percent},
                   {"path", "%", path->rms_percent},
                   {"turn", "°", path->turn_deg},
                   {"memory", "MB", run.peak_mb}}});
  if (promise.name == "slide" && promise.lens_given)
    promise_area(bench, run, clip, truth, path->truth_from_found.scale);
}

// No shape may be told from these; what it falls back to is the recipe's affair.
void promise_refusals(Bench& bench) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> clips = {
      {"a still scope", {"--path", "still", "--no-instrument"}},
      {"a pure turn", {"--path", "turn"}},
      {"a zoom", {"--path", "zoom", "--no-instrument"}},
      {"a clip whose only motion is an instrument's", {"--path", "still"}}};
  int confident = 0;
  for (const auto& [what, options] : clips) {
    std::string name = what;
    std::replace(name.begin(), name.end(), ' ', '_');
    const fs::path clip = make_clip(bench, name, options);
    bench.now(what);
    const MotionRun run = run_motion(bench, frames_of(clip), {}, name + "_motion");
    confident += run.refusal.empty() && fs::exists(run.folder / "surface.ply");
  }
  bench.add(Figure{"clips without parallax that were given a shape", "", double(confident), 0});
}

}  // namespace

void promise_motion_of_phantom(Bench& bench) {
  const std::vector<std::string> tour = {"--path", "tour", "--no-instrument"};
  const std::vector<std::string> hard = {"--path",    "tour", "--breathing", "3",
                                         "--blurred", "0.1",  "--bit-rate",  "4"};
  promise_clip(bench, {"tour, lens given", "tour", tour, true, 0.5, 1.0, 90});
  promise_clip(bench, {"tour, lens unknown", "tour", tour, false, 1.0, 1.5, 90});
  promise_clip(bench, {"breathing, instrument, blur, H.264", "hard", hard, true, 1.5, 2.5, 80});
  promise_clip(bench, {"clip sideways", "slide", {"--path", "slide"}, true, 0.5, 1.0, 90});
  promise_refusals(bench);
}

}  // namespace organbake
