// SPDX-License-Identifier: Apache-2.0
#include "organplay.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "comparison/comparison_module.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"
#include "organbake/image/video_pipe.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/warp/paper_warp.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

// Returns what the frames were held against, where they were.
std::optional<ReferenceFrames> play_script(const Command& command, Player& player,
                                           const Script& script, Results& results,
                                           const RunContext& context) {
  PlayOptions options;
  options.width = script.width;
  options.height = script.height;
  options.instruments = command.instruments;
  options.draw = drawing(command, player, script.light);
  options.draw.measure = !command.report.empty();
  const auto lens = lens_picture(command, options.draw, script.width, script.height);
  if (lens) options.lens = lens->pinhole(), lens->prepare(options.draw);
  std::optional<ReferenceFrames> reference;
  if (!command.reference.empty()) reference.emplace(command.reference, script.frames);
  if (std::any_of(script.camera.begin(), script.camera.end(), [&](const CameraKeyframe& key) {
        return !key.camera_from_world && leads_past_pole(player.bundle().cameras, key.pose);
      }))
    context.warn(
        "an elevation of the script's camera leads past the pole, above or below the organ: the "
        "view stops there");
  player.load_all();  // what is wrong with a camera is said before the first frame
  std::optional<AtomicFolder> folder;
  if (!command.out_folder.empty()) folder.emplace(command.out_folder);
  std::optional<TruthRecorder> truth;
  if (command.wants_truth()) {
    options.draw.keep_bound = true;
    truth.emplace(folder->path(), truth_options(command, script, player, lens), options.draw);
  }
  ShownPicture shown(player, lens, command.eyes_mm);
  std::optional<VideoPipe> video;
  if (!command.video.empty())
    video.emplace(command.video,
                  VideoFormat{shown.width_of(script.width), script.height, 1 / script.time_step_s});

  constexpr int kQuick = 1;  // PNG level: frames are looked at once
  context.progress(0);
  options.watch = [&](const PlayedScene& scene) {
    DrawOptions drawn = options.draw;
    drawn.solids = scene.solids;
    const Rgb8Image& picture = shown.of(scene.picture, scene.view, drawn);
    if (folder) write_png(folder->path() / frame_file_name(scene.frame), picture, kQuick);
    if (video) video->add(picture);
    if (reference) reference->compare(scene.frame, picture);
    if (truth) truth->add(player, scene);
    context.progress(double(scene.frame + 1) / script.frames);
  };
  const auto frames = play(player, script, options, {}, context);
  context.throw_if_cancelled();
  if (truth) truth->finish();
  if (folder) folder->commit(), results.wrote("out", command.out_folder);
  if (video) video->finish(), results.wrote("video", command.video);
  if (!command.report.empty()) {
    write_file_atomically(command.report, play_report(script, player, frames));
    results.wrote("report", command.report);
  }
  return reference;
}

Json reference_json(const Command& command, const ReferenceFrames& reference) {
  const double least_db = reference.least_psnr_db();
  return {{"folder", command.reference.string()},
          {"least_psnr_db", std::isinf(least_db) ? Json() : Json(least_db)},  // null: all are equal
          {"worst_frame", std::isinf(least_db) ? Json() : Json(reference.worst_frame())},
          {"threshold_db", command.threshold_db},
          {"passed", least_db >= command.threshold_db}};
}

// Throws where a frame differs by more than was allowed.
void check_frames(const Command& command, const ReferenceFrames& reference,
                  const RunContext& context) {
  reference.check(command.threshold_db);
  const double least_db = reference.least_psnr_db();
  context.info(std::isinf(least_db) ? "every frame equals its reference"
                                    : "every frame is like its reference: the least PSNR is " +
                                          to_text(least_db, 2) + " dB");
}

// What the command line says goes before the script's own.
void choose_size(Script& script, const Command& command) {
  if (script.width > 0 && !command.size) return;
  script.width = command.picture_size().width;
  script.height = command.picture_size().height;
}

// Drawing and packing a large picture take their time: who asks to stop meanwhile gets none.
void write_picture(const fs::path& file, const Rgb8Image& picture, const RunContext& context) {
  context.throw_if_cancelled();
  const std::string png = encode_png(picture);
  context.throw_if_cancelled();
  write_file_atomically(file, png);
}

Rgb8Image sheet_of(const Command& command, Player& player, const RunContext& context) {
  constexpr int kWidth_px = 480, kHeight_px = 400;
  DrawOptions options = drawing(command, player);
  if (!command.cavity || options.light != DrawnLight::scope)
    return contact_sheet(player, kWidth_px, kHeight_px, options, context);
  options.background = DrawOptions::kCavity;
  options.keep_depth = true;
  return contact_sheet(player, kWidth_px, kHeight_px, options, context,
                       [organs = rest_bounds(player)](const Frame& frame, const View& view) {
                         Rgb8Image seen;
                         paint_cavity_wall({frame, view, organs}, DrawOptions::kCavity, seen);
                         return seen;
                       });
}

void draw_one(const Command& command, Player& player, Results& results, const RunContext& context) {
  Frame frame;
  View view = view_of(command, player);
  DrawOptions options = drawing(command, player);
  const auto lens =
      lens_picture(command, options, view.camera.intrinsics.width, view.camera.intrinsics.height);
  if (lens) view.camera.intrinsics = lens->pinhole();
  if (lens) lens->prepare(options);
  options.keep_bound = command.wants_truth();
  const DrawReport report = player.draw(view, options, frame);
  if (const auto why = why_empty(player, view, report)) context.warn(*why);
  ShownPicture shown(player, lens, command.eyes_mm);
  write_picture(command.frame_file, shown.of(frame, view, options), context);
  if (command.wants_truth())
    write_truth_of_view(command, player, view, lens.get(), options, frame, context);
  results.wrote("frame", command.frame_file);
}

void compare(const Command& command, Player& player, Results& results, const RunContext& context) {
  const BundleReader reader(command.bundles.front());
  if (!reader.has("surface.ply")) {
    throw BadDataError(
        command.bundles.front(),
        "carries no surface.ply to compare with; bake it with --set bundle.surface=true");
  }
  CompareOptions options;
  if (!command.angles_rad.empty()) options.angles_rad = command.angles_rad;
  if (command.size) options.size_px = command.size->height;
  const auto compare_by_module = reinterpret_cast<decltype(&organplay_compare)>(load_door(
      {"organplay_comparison.so", "this organplay was built without the paper's comparison",
       "the comparison cannot be loaded",
       "without it, give --script with --out, --view-deg with -o, or --bench"},
      "organplay_compare"));
  ComparisonTexts found;
  compare_by_module(player, reader.read_surface(), options, context, found);
  context.throw_if_cancelled();
  results.add("comparison", Json::parse(found.json), found.text);
}

// A file, or one of those that come with the recipes by its name alone.
fs::path known_file(const fs::path& word, const char* folder) {
  if (word.empty() || word.has_parent_path() || fs::exists(word)) return word;
  const fs::path bin = program_folder();
  std::vector<std::string> names;
  for (const fs::path& recipes :
       {bin / "../share/organbake/recipes", bin / "../../../pipelines/recipes"}) {
    const fs::path known = recipes / folder / (word.stem().string() + ".json");
    if (fs::exists(known)) return fs::weakly_canonical(known);
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(recipes / folder, none))
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  if (names.empty()) return word;
  throw NoInputError(word, "is neither a file nor one that comes with the recipes" +
                               suggestion(word.stem().string(), names));
}

void check_bundles(const std::vector<fs::path>& bundles) {
  std::set<fs::path> seen;
  std::error_code ignored;
  for (const fs::path& bundle : bundles)
    if (!seen.insert(fs::weakly_canonical(bundle, ignored)).second)
      throw UsageError(bundle.string() + " is given twice: an organ lies in its place once");
}

// Of the skin in the middle of the view, by a small picture.
double depth_ahead_mm(const Command& command, Player& player) {
  constexpr int kSide = 33;
  Frame frame;
  DrawOptions options = drawing(command, player);
  options.keep_depth = true;
  player.draw(orbit_view(player.bundle().cameras, command.view, kSide, kSide), options, frame);
  const double depth_mm = frame.depth_mm[frame.depth_mm.size() / 2];
  if (std::isfinite(depth_mm)) return depth_mm;
  throw UsageError("--distance-mm: no tissue lies in the middle of --view-deg; turn the view");
}

}  // namespace

DrawOptions drawing(const Command& command, const Player& player,
                    std::optional<DrawnLight> of_script) {
  DrawOptions options;
  options.light = command.paper_warp ? DrawnLight::baked
                                     : player.light_for(command.light ? command.light : of_script);
  return options;
}

View view_of(const Command& command, Player& player) {
  if (!command.cameras.empty()) return first_recorded_view(command);
  const auto [width, height] = command.picture_size();
  const CameraSet& cameras = player.bundle().cameras;
  if (leads_past_pole(cameras, command.view))
    throw UsageError(
        "the view's elevation leads past the pole, above or below the organ, where a view stops: "
        "take one nearer to 0, and half a turn of azimuth to look from the other side");
  OrbitPose pose = command.view;
  if (command.distance_mm) {
    const double unit_mm =
        (cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm).norm();
    pose.distance += (*command.distance_mm - depth_ahead_mm(command, player)) / unit_mm;
  }
  return orbit_view(cameras, pose, width, height);
}

void run_command(const Command& given, const ContextOf& context_of) {
  Command command = given;
  check_bundles(command.bundles);
  command.script = known_file(command.script, "interactions");
  command.lens = known_file(command.lens, "");
  const RunContext context = context_of("organplay");
  if (!command.lens.empty()) {
    const Intrinsics lens = read_scope_lens(command.lens).intrinsics;
    command.lens_size = {lens.width, lens.height};
  }
  if (command.wants_window()) return open_window(command, context);
  if (command.bench_frames > 0) return run_bench(command, context);
  if (!command.dataset.empty()) return run_dataset(command, context_of("data set"));
  check_outputs(command);
  // What can be wrong with the script is said before the bundle is read.
  std::optional<Script> script;
  DeformOptions deform;
  if (!command.script.empty()) {
    script = read_script(command.script);
    if (!command.cameras.empty())
      take_recorded(recorded_cameras(command), command.cameras.string(), *script);
    choose_size(*script, command);
    deform.time_step_s = script->time_step_s;
    deform.solver = script->solver;
  }
  if (command.solver) deform.solver = command.solver;
  // The paper's table is of springs, whatever the organ has.
  if (command.compare && !deform.solver) deform.solver = TissueSolver::springs;
  Player player(command.bundles, deform, command.compare || command.paper_warp);
  if (command.paper_warp) player.draw_by(std::make_shared<PaperWarp>(player.bundle()));
  draw_as_asked(command, player, context);
  if (script) context.info("solver: " + player.solver_text());
  context.throw_if_cancelled();
  Results results(command.shared.json);
  std::optional<ReferenceFrames> reference;
  if (script) reference = play_script(command, player, *script, results, context_of("script"));
  if (reference) results.add("reference", reference_json(command, *reference), "");
  if (!command.frame_file.empty()) draw_one(command, player, results, context);
  if (!command.sheet.empty()) {
    write_picture(command.sheet, sheet_of(command, player, context_of("sheet")), context);
    results.wrote("sheet", command.sheet);
  }
  if (command.compare) compare(command, player, results, context_of("comparison"));
  warn_of_processor(command, player, context);
  results.finish();
  if (reference) check_frames(command, *reference, context);
}

}  // namespace organbake
