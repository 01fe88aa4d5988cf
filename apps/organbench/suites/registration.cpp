// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/registration/register_photo.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "bench.h"
#include "error_pictures.h"
#include "organbake/core/text.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "organbake/registration/overlay.h"
#include "suites.h"
#include "suites/registration_parts.h"
#include "suites/registration_scenes.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Errors of some runs against the truth.
struct Errors {
  std::vector<double> mtre_mm, reprojection_px;
  int ok = 0;
  Rgb8Image worst_photo;
  RegisteredPhoto worst_found;

  void add(const LampScenes& scenes, std::size_t camera, const Rgb8Image& photo,
           const RegisteredPhoto& found) {
    mtre_mm.push_back(scenes.mtre_mm(camera, found.camera.camera_from_world));
    if (mtre_mm.back() == spread_of(mtre_mm).most) worst_photo = photo, worst_found = found;
    reprojection_px.push_back(scenes.reprojection_px(camera, found.camera.camera_from_world));
    ok += found.quality.verdict == Verdict::ok;
  }
  double share_below(double mm) const {
    const auto below =
        std::count_if(mtre_mm.begin(), mtre_mm.end(), [mm](double e) { return e <= mm; });
    return 100.0 * static_cast<double>(below) / static_cast<double>(mtre_mm.size());
  }
  double share_ok() const { return 100.0 * ok / static_cast<double>(mtre_mm.size()); }
};

struct Starts {
  int count = 0;
  double shift_mm = 0, turn_deg = 0;  // at most; 0 and 0: a search all round
};

Errors run(Bench& bench, const LampScenes& scenes, const Starts& starts, bool hard,
           bool instrument = false) {
  Errors errors;
  for (int i = 0; i < starts.count; ++i) {
    bench.context().throw_if_cancelled();
    const std::size_t camera = static_cast<std::size_t>(i) % scenes.cameras().size();
    PhotoToRegister photo = scenes.photo(camera, static_cast<std::uint64_t>(i), hard);
    if (instrument) scenes.put_instrument(photo.image, static_cast<std::uint64_t>(i));
    if (starts.shift_mm > 0)
      photo.start =
          scenes.start(camera, starts.shift_mm, starts.turn_deg, static_cast<std::uint64_t>(i));
    errors.add(scenes, camera, photo.image,
               register_photo(scenes.surface(), photo, {}, bench.context()));
  }
  return errors;
}

std::string cases(int count) { return ", " + std::to_string(count) + " cases"; }

void show_worst(Bench& bench, const LampScenes& scenes, const Errors& errors,
                const std::string& what) {
  constexpr int kMostSide = 440;
  bench.show(
      shrunk(draw_overlay(scenes.surface(), errors.worst_photo, errors.worst_found, {}), kMostSide),
      "The worst of " + what + ": mTRE " + to_text(spread_of(errors.mtre_mm).most, 3) +
          " mm. The outline and, in every other field, the predicted shading over the photograph.");
}

void promise_accuracy(Bench& bench, const LampScenes& scenes) {
  const Starts starts{bench.count(4, 24, 200), 10, 10};
  bench.now("phantom photographs, noise alone");
  const Errors clean = run(bench, scenes, starts, false);
  const std::string what = "phantom, 2 % noise, gain and offset" + cases(starts.count);
  const double mtre = spread_of(clean.mtre_mm).median;
  bench.add(Figure{what + ": mTRE, median", "mm", mtre, 0.05});
  bench.add(
      Figure{what + ": reprojection, median", "px", spread_of(clean.reprojection_px).median, 0.1});
  bench.add(Figure{what + ": verdict ok", "%", clean.share_ok(), 95, Figure::Goal::at_least});
  show_worst(bench, scenes, clean, what);

  if (bench.quick()) return;  // in a small photograph texture hides the outline: doubtful, rightly
  bench.now("phantom photographs with vignette, texture, highlights");
  const Errors hard = run(bench, scenes, starts, true);
  const std::string harder = "the same with vignette, albedo, highlights" + cases(starts.count);
  bench.add(Figure{harder + ": mTRE, median", "mm", spread_of(hard.mtre_mm).median, 0.3});
  bench.add(Figure{harder + ": verdict ok", "%", hard.share_ok(), 95, Figure::Goal::at_least});
  show_worst(bench, scenes, hard, harder);
}

// Photographs of the very mesh, so that the surface's own error is not in it.
void promise_efficiency(Bench& bench) {
  bench.now("photographs of the mesh itself");
  const LampScenes scenes(bench.quick() ? 256 : 1024, bench.quick() ? 1 : 4,
                          PhotographedSurface::mesh);
  const Starts starts{bench.count(4, 40, 40), 3, 3};  // a mean of fewer squares is a matter of luck
  const Errors errors = run(bench, scenes, starts, false);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < errors.mtre_mm.size(); ++i)
    ratios.push_back(errors.mtre_mm[i] * errors.mtre_mm[i] /
                     std::pow(scenes.floor_mm(i % scenes.cameras().size()), 2));
  double mean = 0;
  for (const double ratio : ratios) mean += ratio / static_cast<double>(ratios.size());
  bench.add(
      Figure{"photographs of the mesh" + cases(starts.count) + ": RMS mTRE / Cramér–Rao floor", "×",
             std::sqrt(mean), 1.2});
}

void promise_reach(Bench& bench, const LampScenes& scenes) {
  bench.now("starts up to 30 mm and 20° off");
  const Starts far{bench.count(4, 12, 40), 30, 20};
  const Errors reached = run(bench, scenes, far, false);
  bench.add(Figure{"starts up to 30 mm / 20°" + cases(far.count) + ": mTRE ≤ 1 mm", "%",
                   reached.share_below(1), 95, Figure::Goal::at_least});
  bench.now("no start at all");
  const Starts none{bench.count(1, 8, 50), 0, 0};
  const Errors found = run(bench, scenes, none, false);
  bench.add(Figure{"no start" + cases(none.count) + ": mTRE ≤ 1 mm", "%", found.share_below(1), 95,
                   Figure::Goal::at_least});
  bench.now("an instrument in front");
  const Starts near{bench.count(2, 8, 24), 10, 10};
  const Errors covered = run(bench, scenes, near, false, true);
  bench.add(
      Figure{"instrument over 20 % of the organ, unmasked" + cases(near.count) + ": mTRE, median",
             "mm", spread_of(covered.mtre_mm).median, 0.5});
}

// Run time against error: how fine the pyramid's last level is, and how often it iterates.
void sweep(Bench& bench, const LampScenes& scenes) {
  const std::string task = "phantom photograph, 81,920 faces, start 10 mm / 10°";
  PhotoToRegister photo = scenes.photo(0, 1, false);
  photo.start = scenes.start(0, 10, 10, 1);
  for (const int side : {128, 256, 512, 1024}) {
    for (const int iterations : {2, 8}) {
      if (side > scenes.cameras()[0].intrinsics.width) continue;
      RegistrationOptions options;
      options.finest_side_px = side;
      options.solver_iterations = iterations;
      RegisteredPhoto found;
      const Timing timing = bench.time(
          [&] { found = register_photo(scenes.surface(), photo, options, bench.context()); });
      bench.add(Point{task,
                      "organbake register, " + std::to_string(iterations) + " iterations",
                      false,
                      {{"finest side", "px", double(side)}, {"iterations", "", double(iterations)}},
                      timing,
                      {{"mTRE", "mm", scenes.mtre_mm(0, found.camera.camera_from_world)}}});
    }
  }
}

void promise_time(Bench& bench, const LampScenes& scenes) {
  if (bench.quick()) return;  // what is promised is promised of the whole photograph
  PhotoToRegister photo = scenes.photo(0, 2, false);
  const auto work = [&] { register_photo(scenes.surface(), photo, {}, bench.context()); };
  const std::string size = std::to_string(photo.intrinsics.width) + "² photo, 81,920 faces";
  const Timing global = bench.time(work);
  photo.start = scenes.start(0, 10, 10, 2);
  const Timing near = bench.time(work);
  bench.add(Figure{size + ", from a start: time", "s", near.wall_ms.median / 1000, 1});
  bench.add(Figure{size + ", no start: time", "s", global.wall_ms.median / 1000, 10});
}

// Another organ, the mirrored mesh, a start out of reach, a wrong lens: each from a start and,
// where that is another question, without.
void promise_verdicts(Bench& bench, const LampScenes& scenes) {
  bench.now("wrong organs, mirrored meshes, wrong lenses, starts out of reach");
  const int count = bench.count(4, 24, 100);
  const RegisteredSurface mirrored(scenes.mirrored());
  int false_ok = 0;
  for (int i = 0; i < count; ++i) {
    const std::size_t camera = static_cast<std::size_t>(i / 8) % scenes.cameras().size();
    const auto seed = static_cast<std::uint64_t>(i);
    PhotoToRegister photo = scenes.photo(camera, seed, false);
    const bool search = (i / 4) % 2 == 1;
    const bool out_of_reach = i % 4 == 2;
    if (!search || out_of_reach)
      photo.start = out_of_reach ? scenes.start_at_least(camera, 40, 90, seed)
                                 : scenes.start(camera, 10, 10, seed);
    if (i % 4 == 3) {
      const double factor = i % 8 == 3 ? 0.8 : 1.2;
      photo.intrinsics.fx *= factor;
      photo.intrinsics.fy *= factor;
    }
    const RegisteredSurface& surface = i % 4 == 0   ? scenes.other_organ(2 + i % 3)
                                       : i % 4 == 1 ? mirrored
                                                    : scenes.surface();
    const auto found = register_photo(surface, photo, {}, bench.context());
    const bool right = out_of_reach && scenes.mtre_mm(camera, found.camera.camera_from_world) < 1;
    false_ok += found.quality.verdict == Verdict::ok && !right;
  }
  bench.add(Figure{"wrong cases called ok, of " + std::to_string(count), "", double(false_ok), 0});
}

Eigen::Matrix4d read_matrix(const fs::path& path) {
  std::ifstream file(path);
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 16; ++i) file >> m(i / 4, i % 4);
  return m;
}

RigidTransform rigid(const Eigen::Matrix4d& m) {
  return {m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>()};
}

void promise_rendered_liver(Bench& bench) {
  const fs::path folder = bench.data("registration/rendered_liver");
  if (folder.empty()) return;
  bench.now("the rendered liver");
  const RegisteredSurface surface(read_mesh(folder / "liver-H07.ply"));
  PhotoToRegister photo;
  photo.image = read_photo(folder / "synthetic-left.png");
  photo.intrinsics = {1920, 1080, 2012.186314, 2017.966019, 944.7173708, 617.1093984};
  const RigidTransform truth = rigid(read_matrix(folder / "camera_to_world.txt")).inverse() *
                               rigid(read_matrix(folder / "model_to_world.txt"));
  RegistrationOptions options;
  options.light = LightModel::estimated;
  double worst_mm = 0, worst_deg = 0;
  const int count = bench.count(1, 4, 8);
  for (int i = 0; i < count; ++i) {
    photo.start = start_from(surface, truth, 20, 15, static_cast<std::uint64_t>(i));
    const auto found = register_photo(surface, photo, options, bench.context());
    worst_mm = std::max(worst_mm, mean_distance_mm(surface, truth, found.camera.camera_from_world));
    const Eigen::AngleAxisd turn(found.camera.camera_from_world.rotation *
                                 truth.rotation.transpose());
    worst_deg = std::max(worst_deg, turn.angle() * 180 / std::numbers::pi);
  }
  const std::string what = "rendered liver, starts 20 mm / 15° off" + cases(count);
  bench.add(Figure{what + ": worst mTRE", "mm", worst_mm, 1});
  bench.add(Figure{what + ": worst angle", "°", worst_deg, 0.5});
}

}  // namespace

void run_registration_suite(Bench& bench) {
  const LampScenes scenes(bench.quick() ? 256 : 1024, bench.quick() ? 2 : 8,
                          PhotographedSurface::formula);
  if (bench.wants("time")) {
    sweep(bench, scenes);
    promise_time(bench, scenes);
  }
  if (bench.wants("accuracy")) promise_accuracy(bench, scenes);
  if (bench.wants("efficiency")) promise_efficiency(bench);
  if (bench.wants("reach")) promise_reach(bench, scenes);
  if (bench.wants("verdicts")) promise_verdicts(bench, scenes);
  if (bench.wants("rendered liver")) promise_rendered_liver(bench);
  promise_what_people_have(bench);
  if (bench.wants("tracking")) promise_tracking(bench);
}

}  // namespace organbake
