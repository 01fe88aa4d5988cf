// SPDX-License-Identifier: Apache-2.0
#include "command.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <sstream>

#include "manual.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/player/comparison_table.h"

namespace organbake {
namespace {

void check(const Command& c) {
  if (!c.wants_window() && c.bundles.empty()) throw UsageError("BUNDLE is missing: what to play");
  const bool shows =
      !c.out_folder.empty() || !c.video.empty() || !c.report.empty() || !c.reference.empty();
  if (!c.script.empty() && !shows)
    throw UsageError("--script needs --out DIR, --video FILE, --report FILE or --reference DIR");
  if (c.script.empty() && shows)
    throw UsageError("--out, --video, --report and --reference need --script FILE");
  if (!c.dataset.empty()) {
    if (c.frame_file.empty()) throw UsageError("--dataset needs -o DIR, the folder to make");
    if (!c.script.empty() || c.wants_truth() || !c.cameras.empty() || !c.lens.empty() ||
        c.compare || c.bench_frames > 0 || c.paper_warp || !c.sheet.empty())
      throw UsageError("--dataset goes alone, with -o DIR: its SPEC says what is drawn");
  }
  if (c.wants_truth() && c.out_folder.empty() && c.frame_file.empty() && c.bench_frames == 0)
    throw UsageError("--layers and --stereo need --script with --out DIR, or -o FILE");
  if (c.bench_frames > 0 && c.stereo_mm) throw UsageError("--bench draws one eye alone");
  if (c.layers.flow && !c.frame_file.empty())
    throw UsageError("--layers flow needs --script with --out DIR: one picture does not move");
  if (c.wants_truth() && c.paper_warp)
    throw UsageError("--layers and --stereo do not go with --warp paper");
  if (!c.lens.empty() && c.out_folder.empty() && c.video.empty() && c.reference.empty() &&
      c.frame_file.empty())
    throw UsageError("--lens needs --script with --out DIR, --video or --reference, or -o FILE");
  if (!c.lens.empty() && c.paper_warp) throw UsageError("--lens does not go with --warp paper");
  if (!c.cameras.empty() && c.script.empty() && c.frame_file.empty())
    throw UsageError("--cameras needs --script or -o");
  if (c.bench_frames > 0 &&
      (!c.script.empty() || !c.frame_file.empty() || !c.sheet.empty() || c.compare))
    throw UsageError("--bench goes alone, without --script, -o, --sheet and --compare");
  if (c.paper_warp && c.script.empty() && c.frame_file.empty())
    throw UsageError("--warp paper needs --script or -o; --compare measures both warps");
  if (c.paper_warp && c.light && *c.light != DrawnLight::baked)
    throw UsageError(std::string("--light ") + to_string(*c.light) +
                     ": --warp paper draws the baked light alone");
  if (c.bundles.size() > 1 && (c.paper_warp || c.compare))
    throw UsageError("--warp paper and --compare are for one BUNDLE");
  using Compare = CompareOptions;
  if (c.compare && c.size &&
      (c.size->height < Compare::kSmallestSide_px || c.size->height > Compare::kLargestSide_px))
    throw UsageError("--size " + std::to_string(c.size->width) + "x" +
                     std::to_string(c.size->height) + ": --compare needs a height of " +
                     std::to_string(Compare::kSmallestSide_px) + "…" +
                     std::to_string(Compare::kLargestSide_px) + " pixels");
  if (!std::isfinite(c.threshold_db)) throw UsageError("--threshold needs a number of dB");
}

// What is more than one word or number, as it was written.
struct Texts {
  std::string size, angles, angles_rad, view = "0,0", view_rad, warp = "bound", solver, light,
                                        layers, shell;
  bool man = false;
};

void add_options(CLI::App& app, Command& c, Texts& texts) {
  app.add_option("BUNDLE", c.bundles,
                 "folder made by 'organbake bake'; several lie in one world and push each other, "
                 "views and scripts go round the first");
  app.add_option("--script", c.script,
                 "interaction to play (JSON, see 'organbake schema interaction')");
  app.add_option("--out", c.out_folder, "folder for the script's frames, frame_0000.png …");
  app.add_option("--video", c.video, "video of the script's frames (needs ffmpeg)");
  app.add_option("--report", c.report,
                 "JSON report: times by phase, what was skipped, holes, forces");
  app.add_option(
      "--reference", c.reference,
      "folder of the script's frames from another run: ends with 3 when one differs more");
  app.add_option("--threshold", c.threshold_db, "least PSNR to the reference, dB")
      ->capture_default_str();
  app.add_option("--view-deg", texts.view,
                 "azimuth,elevation[,distance]: degrees from camera 0, multiples of its distance")
      ->capture_default_str();
  app.add_option("--view", texts.view_rad, "the same in radians, as it was written once")
      ->excludes("--view-deg");
  app.add_option("-o,--frame", c.frame_file, "one frame at rest from --view-deg, as PNG");
  app.add_option("--cameras", c.cameras,
                 "cameras.json to look from: one camera for each of the script's frames, in the "
                 "place of its own; its first camera for -o");
  app.add_option("--layers", texts.layers,
                 "the truth beside each frame, comma-separated: depth (mm), flow (px), normals, "
                 "mask, id (the skin point), weight, or all; as EXR, the mask as PNG, with "
                 "cameras.json and scenes.jsonl");
  app.add_option(
      "--lens", c.lens,
      "calibration of a scope (JSON, see 'organbake schema scope-lens', or cameras.json) "
      "whose distortion and vignette are put on pictures and layers; its size is theirs "
      "unless --size or the script says another");
  app.add_option("--stereo", c.stereo_mm,
                 "draw a right eye as well, so many millimetres to the right of the view");
  app.add_option("--dataset", c.dataset,
                 "data set to make of the bundles, each on its own, in the folder -o DIR (YAML or "
                 "JSON, see 'organbake schema dataset'); goes on where an earlier run ended");
  app.add_option("--sheet", c.sheet, "contact sheet (PNG): rest, three pokes, views all round");
  app.add_option("--size", texts.size,
                 "size of a frame or of the window, WIDTHxHEIGHT pixels (default 1280x720, or the "
                 "script's own); "
                 "--compare's pictures are squares of its height (default 512)");
  app.add_option("--warp", texts.warp, "bound, or the paper's own chain as a baseline: paper")
      ->check(CLI::IsMember({"bound", "paper"}))
      ->capture_default_str();
  app.add_option(
         "--solver", texts.solver,
         "what stands for the tissue: springs (default), or fem, finite elements on the "
         "tetrahedra of a bundle that was baked with --set mechanics.fem=true; a script may name "
         "its own")
      ->check(CLI::IsMember({"springs", "fem"}));
  app.add_option(
         "--light", texts.light,
         "scope: one light that travels with the view; world: the baked one, on the skin as "
         "it lies now; baked: as baked, wherever skin is pushed (default: what the bundle "
         "is made for; a script may name its own)")
      ->check(CLI::IsMember({"scope", "world", "baked"}));
  app.add_flag_callback(
      "--baked-light", [&texts] { texts.light = "baked"; }, "the same as --light baked");
  app.add_flag_callback(
      "--no-instruments", [&c] { c.instruments = false; }, "leave the tools out of the frames");
  app.add_flag("--compare", c.compare, "compare with the truth: the paper's Table 1, seams, holes");
  app.add_option("--angles-deg", texts.angles,
                 "viewing angles of --compare, degrees, comma-separated");
  app.add_option("--angles", texts.angles_rad, "the same in radians, as they were written once")
      ->excludes("--angles-deg");
  app.add_option("--bench", c.bench_frames,
                 "the first frame from --view-deg, then N of an orbit with a poke; prints times by "
                 "phase, with --layers theirs, too, the longest chain of work in each phase, and "
                 "how much faster than one --threads threads can be at most")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--threads", c.threads, "threads to use, 0 = all")->check(CLI::Range(0, 1024));
  app.add_flag("--json", c.json, "print results as JSON");
  app.add_flag("--quiet", c.quiet, "no log");
  app.add_flag("--man", texts.man, "print the manual page, for man -l -");
  app.add_option("--completions", texts.shell, "print the completions for a shell")
      ->check(CLI::IsMember({"bash", "zsh"}));
  app.set_version_flag("--version", "organplay " ORGANBAKE_VERSION);
}

}  // namespace

bool Command::wants_window() const {
  return script.empty() && frame_file.empty() && sheet.empty() && !compare && bench_frames == 0 &&
         out_folder.empty() && video.empty() && report.empty() && reference.empty();
}

std::optional<Command> read_command(int argc, char** argv) {
  Command c;
  Texts texts;
  CLI::App app(
      "organplay: pokes a baked organ and draws it; in a window, or without a display by any of "
      "--script, -o, --sheet, --compare, --bench");
  add_options(app, c, texts);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    std::ostringstream answer;
    app.exit(asked, answer, std::cerr);
    write_to_stdout(answer.str());
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    throw UsageError(std::string(error.what()) + " (--help lists all)");
  }
  const auto given = [&app](const char* option) { return app.count(option) > 0; };
  if (texts.man || !texts.shell.empty()) {
    write_to_stdout(texts.man ? manual_page(app) : completions(app, texts.shell));
    return std::nullopt;
  }
  c.view = given("--view") ? pose_from({"--view", false}, texts.view_rad)
                           : pose_from({"--view-deg"}, texts.view);
  if (given("--size")) c.size = size_from(texts.size);
  if (given("--angles-deg")) c.angles_rad = angles_from({"--angles-deg"}, texts.angles);
  if (given("--angles")) c.angles_rad = angles_from({"--angles", false}, texts.angles_rad);
  if (given("--layers")) c.layers = layers_from(texts.layers);
  c.paper_warp = texts.warp == "paper";
  c.solver = tissue_solver(texts.solver);
  c.light = drawn_light(texts.light);
  check(c);
  return c;
}

}  // namespace organbake
