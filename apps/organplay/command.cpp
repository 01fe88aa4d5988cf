// SPDX-License-Identifier: Apache-2.0
// The command line of organplay: its options, what their texts mean, and which go together.
#include "organplay.h"

#include <cmath>
#include <cstdlib>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/options/options.h"

namespace organbake {
namespace {

// Finite numbers with commas between them; nothing when one is missing or something else is there.
std::optional<std::vector<double>> number_list(const std::string& text) {
  std::vector<double> values;
  for (const char* at = text.c_str();; ++at) {
    char* end = nullptr;
    values.push_back(std::strtod(at, &end));
    if (end == at || !std::isfinite(values.back())) return std::nullopt;
    if (*end == '\0') return values;
    if (*end != ',') return std::nullopt;
    at = end;
  }
}

constexpr const char* kAngleLimits = ": azimuths are at most 360 degrees, elevations 180";

// The values of options that are more than a number or a name. Each throws a UsageError that names
// the option and what was written.
PictureSize size_from(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos)
    throw UsageError("--size " + text + " is no size; write WIDTHxHEIGHT, for example 1280x720");
  const auto width = number_in<int>(std::string_view(text).substr(0, cross)),
             height = number_in<int>(std::string_view(text).substr(cross + 1));
  const auto can_be_drawn = [](const std::optional<int>& side) {
    return side && *side >= 1 && *side <= kLargestSide_px;
  };
  if (!can_be_drawn(width) || !can_be_drawn(height))
    throw UsageError("--size " + text + ": each side needs a whole number of pixels in 1…" +
                     std::to_string(kLargestSide_px) + ", for example 1280x720");
  return {*width, *height};
}

OrbitPose pose_from(const std::string& text) {
  const std::string named = "--view-deg " + text;
  const auto values = number_list(text);
  if (!values || values->size() < 2 || values->size() > 3)
    throw UsageError(named + " is no view; write AZIMUTH,ELEVATION or AZIMUTH,ELEVATION,DISTANCE");
  constexpr double kNearestDistance = 0.1;  // a nearer eye stands inside the organ
  OrbitPose pose;
  pose.azimuth_rad = radians((*values)[0]);
  pose.elevation_rad = radians((*values)[1]);
  if (values->size() == 3) pose.distance = (*values)[2];
  if (!can_be_azimuth(pose.azimuth_rad) || !can_be_elevation(pose.elevation_rad))
    throw UsageError(named + kAngleLimits);
  if (!(pose.distance >= kNearestDistance && pose.distance < kFarthestDistance))
    throw UsageError(
        named + ": the distance is in multiples of the virtual cameras' own, at least " +
        to_text(kNearestDistance) + " and below a million; --distance-mm takes millimetres");
  return pose;
}

std::vector<double> angles_from(const std::string& text) {
  auto angles = number_list(text);
  if (!angles)
    throw UsageError("--angles-deg " + text + " are no angles; write A,B,C, for example 0,45,90");
  for (double& angle : *angles) {
    angle = radians(angle);
    if (!can_be_azimuth(angle)) throw UsageError("--angles-deg " + text + kAngleLimits);
  }
  return *angles;
}

void check_eyes(const Command& c) {
  check_baseline(*c.eyes_mm);
  if (c.wants_truth())
    throw UsageError(
        "--side-by-side is for pictures alone; --stereo-mm alone tells each eye's truth");
  if (!c.wants_window() && c.frame_file.empty() && c.out_folder.empty() && c.video.empty() &&
      c.reference.empty())
    throw UsageError(
        "--side-by-side needs --script with --out DIR, --video or --reference, -o FILE, or the "
        "window");
}

void check(const Command& c) {
  if (c.stereo_mm) check_baseline(*c.stereo_mm);
  if (!c.wants_window() && c.bundles.empty()) throw UsageError("BUNDLE is missing: what to play");
  const bool shows =
      !c.out_folder.empty() || !c.video.empty() || !c.report.empty() || !c.reference.empty();
  if (!c.script.empty() && !shows)
    throw UsageError("--script needs --out DIR, --video FILE, --report FILE or --reference DIR");
  if (c.script.empty() && shows)
    throw UsageError("--out, --video, --report and --reference need --script FILE");
  if (!c.dataset.empty()) {
    if (c.frame_file.empty()) throw UsageError("--dataset needs -o DIR, the folder to make");
    if (!c.script.empty() || c.wants_truth() || c.eyes_mm || !c.cameras.empty() ||
        !c.lens.empty() || c.compare || c.bench_frames > 0 || c.paper_warp || !c.sheet.empty())
      throw UsageError("--dataset goes alone, with -o DIR: its SPEC says what is drawn");
  }
  if (c.wants_truth() && c.out_folder.empty() && c.frame_file.empty() && c.bench_frames == 0)
    throw UsageError("--layers and --stereo-mm need --script with --out DIR, or -o FILE");
  if (c.bench_frames > 0 && (c.stereo_mm || c.eyes_mm))
    throw UsageError("--bench draws one eye alone");
  if (c.eyes_mm) check_eyes(c);
  if (c.layers.flow && !c.frame_file.empty())
    throw UsageError("--layers flow needs --script with --out DIR: one picture does not move");
  if (c.wants_truth() && c.paper_warp)
    throw UsageError("--layers and --stereo-mm do not go with --warp paper");
  if (!c.lens.empty() && !c.wants_window() && c.out_folder.empty() && c.video.empty() &&
      c.reference.empty() && c.frame_file.empty())
    throw UsageError(
        "--scope needs --script with --out DIR, --video or --reference, -o FILE, or the window");
  if (!c.lens.empty() && c.paper_warp) throw UsageError("--scope does not go with --warp paper");
  if (!c.cameras.empty() && c.script.empty() && c.frame_file.empty())
    throw UsageError("--cameras needs --script or -o");
  if (c.bench_frames > 0 &&
      (!c.script.empty() || !c.frame_file.empty() || !c.sheet.empty() || c.compare))
    throw UsageError("--bench goes alone, without --script, -o, --sheet and --compare");
  if (c.paper_warp && (c.compare || (c.script.empty() && c.frame_file.empty())))
    throw UsageError("--warp paper needs --script or -o; --compare measures both warps");
  if (c.paper_warp && c.drawn_by == DrawnBy::graphics)
    throw UsageError("--draw gpu: graphics hardware does not draw the paper's own warp");
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
  if (!std::isfinite(c.threshold_db)) throw UsageError("--threshold-db needs a number of dB");
}

// What is more than one word or number, as it was written.
struct Texts {
  std::string size, angles, view = "0,0", warp = "bound", draw = "auto", solver, light, layers,
                            background = "cavity";
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  double stereo_mm = kNone, distance_mm = kNone;
  bool side_by_side = false;
};

void add_pictures(OptionList& list, Command& c, Texts& texts) {
  list.begin_group("Pictures")
      .add("frame", &c.frame_file,
           {.help = "one frame at rest from --view-deg, as PNG",
            .value = "FILE",
            .short_flag = "-o"})
      .add("sheet", &c.sheet,
           {.help = "contact sheet: rest, three pokes, views from all sides that were seen, as PNG",
            .value = "FILE"})
      .add("view_deg", &texts.view,
           {.help = "azimuth, elevation and, if need be, distance: degrees from camera 0, and "
                    "multiples of its distance",
            .value = "DEG,DEG[,X]"})
      .add("distance_mm", &texts.distance_mm,
           {.help = "look at the tissue in the middle of --view-deg from so far, in the place of "
                    "its distance",
            .range = {1, 10000}})
      .add("cameras", &c.cameras,
           {.help = "cameras.json to look from: one camera for each of the script's frames, in the "
                    "place of its own; its first camera for -o",
            .value = "FILE"})
      .add("size", &texts.size,
           {.help =
                "size of a frame or of the window in pixels; else 1280x720, or the script's own; "
                "--compare's pictures are squares of its height, else of 512",
            .value = "WIDTHxHEIGHT"})
      .add("scope", &c.lens,
           {.help = "preset of a scope (JSON, see 'organbake schema scope-lens', or cameras.json): "
                    "its distortion and vignette are put on pictures and layers, its camera's "
                    "round field, exposure, haze, bloom, sharpening, grain, focus, folds and "
                    "surroundings on pictures alone; in the window the camera's alone; "
                    "its size is theirs unless --size or the script says another, "
                    "which shows their middle where its shape differs",
            .value = "FILE"})
      .add("instruments", &c.instruments, {.help = "draw the tools"});
}

void add_scripts(OptionList& list, Command& c) {
  list.begin_group("Scripts")
      .add(
          "script", &c.script,
          {.help = "interaction to play (JSON, see 'organbake schema interaction'), or the name of "
                   "one that comes with the recipes: poke, demo, cut, dissect …",
           .value = "FILE|NAME"})
      .add("out", &c.out_folder,
           {.help = "folder for the script's frames, frame_0000.png …", .value = "DIR"})
      .add("video", &c.video,
           {.help = "video of the script's frames (needs ffmpeg)", .value = "FILE"})
      .add(
          "report", &c.report,
          {.help = "JSON report: times by phase, what was skipped, holes, forces", .value = "FILE"})
      .add("reference", &c.reference,
           {.help = "folder of the script's frames from another run: ends with 3 when one differs "
                    "more than --threshold-db allows",
            .value = "DIR"})
      .add("threshold_db", &c.threshold_db, {.help = "least PSNR to the reference"});
}

void add_truth(OptionList& list, Command& c, Texts& texts) {
  list.begin_group("Truth and data sets")
      .add("layers", &texts.layers,
           {.help = "the truth beside each frame, comma-separated: depth (mm), flow (px), normals, "
                    "mask, id (the skin point), weight, or all; as EXR, the mask as PNG, with "
                    "cameras.json and scenes.jsonl",
            .value = "NAME[,NAME]"})
      .add("stereo_mm", &texts.stereo_mm,
           {.help = "draw a right eye as well, so far to the right of the view, with parallel "
                    "axes; 3D laparoscopes have about 5"})
      .add("side_by_side", &texts.side_by_side,
           {.help = "both eyes in one picture, or in the window; --size is each eye's, or the "
                    "window's; 5 mm apart unless --stereo-mm says otherwise"})
      .add("dataset", &c.dataset,
           {.help = "data set to make of the bundles, each on its own, in the folder -o DIR (YAML "
                    "or JSON, see 'organbake schema dataset'); goes on where an earlier run ended",
            .value = "FILE"});
}

void add_looks(OptionList& list, Texts& texts) {
  std::vector<std::string> lights;
  for (const LightNames& light : kLightNames) lights.emplace_back(light.name);
  list.begin_group("Tissue and light")
      .add("solver", &texts.solver,
           {.help =
                "what stands for the tissue: fem, finite elements on the bundle's tetrahedra, or "
                "springs (default: fem where every bundle has tetrahedra, else springs; springs "
                "for --compare, the paper's table); a script may name its own",
            .choices = {"springs", "fem"}})
      .add("light", &texts.light,
           {.help = "scope: one light that travels with the view; world: the baked one, on the "
                    "skin as it lies now; baked: as baked, wherever skin is pushed; else what the "
                    "bundle is made for, or what the script names",
            .choices = lights})
      .add("background", &texts.background,
           {.help = "behind the organ in the light at the scope, with --scope and on the --sheet: "
                    "a cavity's dim wall, or plain, which leaves to --scope's preset what there is",
            .choices = {"cavity", "plain"}})
      .add("warp", &texts.warp,
           {.help = "bound, or the paper's own chain as a baseline", .choices = {"bound", "paper"}})
      .add("draw", &texts.draw,
           {.help = "auto: the window by graphics hardware where there is any, all else by the "
                    "processor; cpu: all by the processor; gpu: by graphics hardware, be it a "
                    "driver that does as if; what that cannot draw, the processor does",
            .choices = {"auto", "cpu", "gpu"}});
}

void add_measures(OptionList& list, Command& c, Texts& texts) {
  list.begin_group("Measuring")
      .add("compare", &c.compare,
           {.help = "compare with the truth: the paper's Table 1, seams, holes"})
      .add("angles_deg", &texts.angles,
           {.help = "viewing angles of --compare, degrees", .value = "DEG[,DEG]"})
      .add("bench", &c.bench_frames,
           {.help = "the first frame from --view-deg, then N of an orbit with a poke; prints times "
                    "by phase, with --layers theirs, too, the longest chain of work in each phase, "
                    "and how much faster than one --threads threads can be at most",
            .range = {1, 1000000}});
}

constexpr const char* kSummary = "poke a baked organ and draw it";
constexpr const char* kBundles =
    "folders made by 'organbake bake'; several lie in one world and push each other, views and "
    "scripts go round the first";

CommandManual manual_of(const OptionList& options) {
  return {.program = "organplay",
          .summary = kSummary,
          .synopsis = "[BUNDLE…] [OPTIONS]",
          .description =
              "Plays bundles that organbake(1) made: tissue yields to instruments, and pictures "
              "are warped from the baked ones, on the processor alone unless --draw or a window's "
              "graphics hardware says otherwise. Without any of --script, "
              "--frame, --sheet, --compare and --bench it opens a window, which is a package of "
              "its own (organplay-window).",
          .options = manual_options(options),
          .sections = {{.title = "arguments", .entries = {{"BUNDLE…", kBundles}}},
                       exit_status_section()},
          .see_also = {"organbake", "organbake-bake"}};
}

std::string help(const OptionList& options) {
  return std::string("organplay: ") + kSummary +
         "\n\nusage: organplay [BUNDLE…] [OPTIONS]   (without any of --script, -o, --sheet, "
         "--compare, --bench a window opens)\n\n  BUNDLE…                   " +
         kBundles + "\n" + options_help(options);
}

// What was asked about the program itself; nothing where it is to play.
std::optional<std::string> answer(const OptionList& options, const ManualFlags& manuals,
                                  const SharedFlags& shared) {
  if (shared.help) return help(options);
  if (shared.version) return version_text("organplay", shared.json);
  return manuals.text(manual_of(options));
}

// What the texts say, once they are all there.
void interpret(const Texts& texts, Command& c) {
  c.view = pose_from(texts.view);
  if (!texts.size.empty()) c.size = size_from(texts.size);
  if (!texts.angles.empty()) c.angles_rad = angles_from(texts.angles);
  if (!texts.layers.empty()) c.layers = layers_from(texts.layers);
  if (!std::isnan(texts.stereo_mm)) c.stereo_mm = texts.stereo_mm;
  if (!std::isnan(texts.distance_mm)) c.distance_mm = texts.distance_mm;
  if (texts.side_by_side) {
    c.eyes_mm = c.stereo_mm.value_or(kUsualBaseline_mm);
    c.stereo_mm.reset();
  }
  c.paper_warp = texts.warp == "paper";
  c.drawn_by = texts.draw == "gpu"   ? DrawnBy::graphics
               : texts.draw == "cpu" ? DrawnBy::processor
                                     : DrawnBy::automatic;
  c.solver = tissue_solver(texts.solver);
  c.cavity = texts.background == "cavity";
  c.light = drawn_light(texts.light);
}

}  // namespace

bool Command::wants_window() const {
  return script.empty() && frame_file.empty() && sheet.empty() && !compare && bench_frames == 0 &&
         out_folder.empty() && video.empty() && report.empty() && reference.empty();
}

std::optional<Command> read_command(int argc, char** argv) {
  Command c;
  Texts texts;
  OptionList options;
  add_pictures(options, c, texts);
  add_scripts(options, c);
  add_truth(options, c, texts);
  add_looks(options, texts);
  add_measures(options, c, texts);
  ManualFlags manuals;
  options.append(manuals.options());
  c.shared.read_defaults();
  options.append(c.shared.options());
  std::vector<std::string> arguments(argv + 1, argv + argc);
  const std::vector<std::string> words = read_arguments(arguments, options, c.notes);
  if (const auto text = answer(options, manuals, c.shared)) {
    write_to_stdout(*text);
    return std::nullopt;
  }
  c.bundles.assign(words.begin(), words.end());
  interpret(texts, c);
  check(c);
  return c;
}

}  // namespace organbake
