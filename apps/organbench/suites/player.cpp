// SPDX-License-Identifier: GPL-3.0-or-later
// What the player costs beside its pictures: truth layers, the start of a new program, its memory
// and size, and a step of the tissue while a probe is pressed in and dragged.
#include "organbake/player/player.h"

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bench.h"
#include "measuring/programs.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/decimate/decimate.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/phantom/phantom.h"
#include "organbake/pipelines/processes.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

constexpr double kMb = double(1 << 20);

// A picture with depth, flow and mask beside it, on one core.
void promise_truth(Bench& bench, PlayerBundles& bundles) {
  const FrameSize vga{640, 480, 10};
  const std::string task = vga.name() + ", one thread: picture";
  bench.now(task + " and its truth");
  Player player(bundles.folder({80, "fitted", bundles.map_size()}));
  player.load_all();
  const ThreadLimit one_thread(1);
  Frame plain, kept;
  TruthTracker tracker(layers_from("depth,flow,mask"));
  Flow forward;
  const auto timings = bench.time(std::vector<std::function<void()>>{
      [&] {
        for (int i = 0; i < kFrames; ++i)
          player.draw(view_at(player.bundle(), vga, i), {.light = DrawnLight::baked}, plain);
      },
      [&] {
        DrawOptions options;
        options.light = DrawnLight::baked;
        options.keep_bound = true;
        for (int i = 0; i < kFrames; ++i) {
          const View view = view_at(player.bundle(), vga, i);
          player.draw(view, options, kept);
          tracker.advance(player, view, {}, kept);
          if (tracker.has_before()) tracker.find_forward(forward);
        }
      }});
  bench.point(task, "organplay, alone", of_one(timings[0], kFrames));
  bench.at_most(task + ", depth, flow and mask, CPU time a frame", "ms", ms_of(timings[1]),
                vga.target_ms);
}

// A cold organplay: time to its first frame, memory, size.
void promise_program(Bench& bench, PlayerBundles& bundles) {
  const int map_size = bundles.map_size();
  const fs::path bundle = bundles.folder({80, "fitted", map_size}), scratch = bench.scratch();
  const std::string organplay = program_folder() / "organplay";
  if (!fs::exists(organplay)) return bench.skip("organplay's start", organplay + " is not there");
  bench.now("organplay's start");
  constexpr const char* kBetweenCameras = "40.435,0";  // a view that needs three of them
  double peak_mb = 0;
  std::vector<double> first_frame_ms;
  for (int round = 0; round < bench.count(2, 5); ++round) {
    run_worker({organplay, bundle, "--bench", "1", "--json", "--size", "1280x720", "--view-deg",
                kBetweenCameras},
               scratch / "program.out", scratch / "program.log", bench.context());
    const auto report = nlohmann::json::parse(read_text_file(scratch / "program.out"));
    // Its own word: the system's for a child counts what this program held when it was started.
    peak_mb = report.at("peak_memory_mb");
    first_frame_ms.push_back(report.at("load_to_first_frame_ms"));
  }
  const std::string maps =
      std::to_string(PlayerBundles::kCameras) + " maps of " + std::to_string(map_size) + "²";
  bench.at_most("a new organplay, load to first frame of 720p, checksums included, " + maps, "s",
                spread_of(first_frame_ms).median / 1000, 0.4);
  // All cameras loaded. A texel: depth as float, colour and height as halves.
  constexpr double kBytesPerTexel = 4 + 3 * 2 + 2;
  const double maps_mb = kBytesPerTexel * PlayerBundles::kCameras * map_size * map_size / kMb;
  if (!bench.quick())
    bench.at_most("organplay's memory with " + maps + " / the maps", "×", peak_mb / maps_mb, 3);

  const fs::path strip = "/usr/bin/strip";
  if (!fs::exists(strip)) return bench.skip("organplay's size", "there is no " + strip.string());
  run_worker({strip, "-o", scratch / "stripped", organplay}, scratch / "program.out",
             scratch / "program.log", bench.context());
  bench.at_most("organplay with all its own libraries, stripped", "MB",
                double(fs::file_size(scratch / "stripped")) / kMb, 5);
}

void run_player(Bench& bench) {
  PlayerBundles bundles(bench.scratch(), bench.context(), bench.quick());
  promise_truth(bench, bundles);
  promise_program(bench, bundles);
}

const RegisteredPart kPlayer("player", run_player,
                             "poked frames: maps against image error and time, deformation, start");

// A probe that presses the organ's front now more, now less, and is dragged sideways.
class Poking {
 public:
  explicit Poking(const TriangleMesh& proxy)
      : front_(Eigen::Vector3d(0.2, -1, 0.3).normalized()),
        aside_(front_.cross(Eigen::Vector3d::UnitZ()).normalized()) {
    const Eigen::Vector3d center = bounds(proxy).center();
    double highest = -1;
    for (const Eigen::Vector3d& v : proxy.vertices) {
      const double cosine = (v - center).normalized().dot(front_);
      if (cosine > highest) highest = cosine, skin_ = v;
    }
  }

  Instrument at(double seconds) const {
    constexpr double kDeep_mm = 15, kAside_mm = 8;
    const double depth = kDeep_mm * (0.5 - 0.5 * std::cos(2 * std::numbers::pi * seconds)) + 2;
    Instrument tip;
    tip.active = true;
    tip.position_mm =
        skin_ + (tip.radius_mm - depth) * front_ + kAside_mm * std::sin(1.3 * seconds) * aside_;
    return tip;
  }

 private:
  Eigen::Vector3d front_, aside_, skin_ = Eigen::Vector3d::Zero();
};

void promise_step(Bench& bench, const TriangleMesh& organ, std::size_t faces, double target_ms,
                  TissueSolver solver = TissueSolver::springs) {
  bench.now("deformation of a proxy of " + std::to_string(faces) + " faces");
  const TriangleMesh proxy = decimate(organ, {.faces = faces}, bench.context()).proxy;
  const Poking poking(proxy);
  const int steps = bench.quick() ? 60 : 300;
  MechanicsOptions mechanics;
  mechanics.fem = solver == TissueSolver::fem;
  DeformOptions deform;
  deform.solver = solver;
  Deformer deformer(proxy, make_mechanics(proxy, mechanics), {}, deform);
  int step = 0;
  std::size_t contacts = 0;
  const Timing timing = bench.time([&] {
    for (int i = 0; i < steps; ++i, ++step)
      contacts += deformer.step({poking.at(step / 60.0)}).contacts;
  });
  const std::string what =
      "deformation step, " + std::to_string(proxy.vertices.size()) + " vertices, " +
      (solver == TissueSolver::fem ? "finite elements, " : "") + "a probe pressed in and dragged";
  bench.at_most(what + ": CPU time, mean", "ms", timing.cpu_ms.median / steps, target_ms);
  // That it is touched at all; a solid rests on fewer points than springs, which crease.
  const double least_contacts = solver == TissueSolver::fem ? 0.5 : 1;
  bench.at_least(what + ": contacts, mean", "", double(contacts) / step, least_contacts);
}

void promise_deformation(Bench& bench) {
  const TriangleMesh organ = OrganPhantom({}).surface(bench.quick() ? 5 : 6);
  promise_step(bench, organ, 80, 0.02);
  promise_step(bench, organ, 80, 1, TissueSolver::fem);
  promise_step(bench, organ, 996, 0.2);
  if (!bench.quick()) promise_step(bench, organ, 9996, 3);
}

const RegisteredPart kPlayerDeformation("player", promise_deformation);

}  // namespace
}  // namespace organbake
