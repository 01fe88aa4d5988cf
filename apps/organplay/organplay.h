// SPDX-License-Identifier: Apache-2.0
#pragma once

// What the user asked for, what organplay does when no window is asked for, its parts that are
// loaded when they are, and what a run writes: pictures as they are shown, the truth beside them,
// and its results.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.h"
#include "organbake/bundle/bundle.h"
#include "organbake/bundle/json_fields.h"
#include "organbake/core/run_context.h"
#include "organbake/deform/deformer.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/truth/truth_recorder.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/view.h"
#include "window/run_window.h"

namespace organbake {

struct PictureSize {
  int width = 1280, height = 720;  // pixels
};

// What the user asked for, what the window takes among it: several bundles are organs that push
// each other; where no light or solver is named, the script's counts. How large the window is
// follows from picture_size().
struct Command : WindowCommand {
  std::filesystem::path script, dataset, out_folder, video, report, sheet, frame_file, reference;
  std::filesystem::path lens;     // of a scope, that the pictures are shown through
  std::filesystem::path cameras;  // to look from, in the view's or the script's place
  OrbitPose view;
  std::optional<double> distance_mm;     // from the tissue in its middle, instead of the view's own
  LayerSet layers;                       // beside the frames
  std::optional<double> stereo_mm;       // from the left eye to the right one, of the truth
  std::optional<PictureSize> size;       // else the script's, or what is usual where it is shown
  std::optional<PictureSize> lens_size;  // of the lens, once it is read
  bool instruments = true;
  bool paper_warp = false;
  bool cavity = true;  // behind the organ, where it is lit from a scope
  bool compare = false;
  std::vector<double> angles_rad;
  int bench_frames = 0;
  double threshold_db = 45;
  SharedFlags shared;
  std::vector<std::string> notes;  // what is to be said of options that are no longer there

  bool wants_truth() const { return layers.any() || stereo_mm; }
  PictureSize picture_size() const { return size.value_or(lens_size.value_or(PictureSize())); }
  // Nothing that can be done without a display was asked for.
  bool wants_window() const;
};

// Throws UsageError. When help, the version or a manual was asked for, prints it and returns
// nothing.
std::optional<Command> read_command(int argc, char** argv);

// Of a task by its name.
using ContextOf = std::function<RunContext(const std::string& task)>;

// Does everything that the command asks for and prints the results on stdout.
void run_command(const Command& command, const ContextOf& context_of);

// From --view-deg and --distance-mm, in --size.
View view_of(const Command& command, Player& player);

// How the skin is drawn: by the paper's warp, or by ours in the light that command or script name.
DrawOptions drawing(const Command& command, const Player& player,
                    std::optional<DrawnLight> of_script = std::nullopt);

// The first frame from --view, then frames of a slow orbit round an organ that is being poked,
// drawn and thrown away.
void run_bench(const Command& command, const RunContext& context);

// A part of organplay that most runs have no use for, and that lies beside the program as
// ../lib/organbake/<file>: the window, drawing by graphics hardware, the comparison, data sets.
struct LoadedModule {
  std::string file;
  std::string missing;  // where there is no such file
  std::string failed;   // "<failed>: what the loader says"
  std::string instead;  // what to do without it
};

// Loads the module until the program ends, for OpenGL's drivers are not made to be unloaded, and
// returns its function `door`. Throws UsageError where it was not built or cannot be loaded.
void* load_door(const LoadedModule& module, const char* door);

// Where --draw gpu was asked for, loads what draws with graphics hardware without a window, lets
// the player draw by it, and says what it is. Throws UsageError where it is missing.
void draw_as_asked(const Command& command, Player& player, const RunContext& context);
// Warns where the processor had to draw the last picture all the same.
void warn_of_processor(const Command& command, const Player& player, const RunContext& context);

// Loads the window's module, which lies beside the program in ../lib/organbake, and runs it.
// Throws UsageError where it was not built or there is no display.
void open_window(const Command& command, const RunContext& context);

// Makes the data set of --dataset in the folder of -o, by a module.
void run_dataset(const Command& command, const RunContext& context);

// What is written of a drawn frame: the frame as it is or as a scope's lens shows it, and beside
// it, where two eyes are asked for, the picture of the right one.
class ShownPicture {
 public:
  ShownPicture(Player& player, std::shared_ptr<const LensPicture> lens,
               std::optional<double> eyes_mm);

  // Pixels that it is wide, of a view that is `width`.
  int width_of(int width) const { return eyes_mm_ ? 2 * width : width; }
  // Until the next one. `options` are the frame's, its tools among them.
  const Rgb8Image& of(const Frame& frame, const View& view, const DrawOptions& options);

 private:
  const Rgb8Image& through_lens(const Frame& frame, const View& view, Rgb8Image& seen) const;

  Player& player_;
  std::shared_ptr<const LensPicture> lens_;
  std::optional<double> eyes_mm_;
  Bounds organs_;  // at rest
  Frame right_frame_;
  Rgb8Image left_, right_, both_;
};

// From --layers and --stereo, checked.
TruthOptions truth_options(const Command& command, const Script& script, const Player& player,
                           std::shared_ptr<const LensPicture> lens);

// Of --scope, for pictures of that size; nothing without one.
std::shared_ptr<const LensPicture> lens_picture(const Command& command, const DrawOptions& options,
                                                int width, int height);

// --cameras; their distortion is left out where --scope stands in its place.
CameraSet recorded_cameras(const Command& command);

// The first camera of --cameras, in --size or its own.
View first_recorded_view(const Command& command);

// The layers, the right eye and cameras.json of one view, beside its picture: for picture.png
// picture_depth.exr, picture_right.png, picture_right_depth.exr, picture_cameras.json and so on.
// frame: the view, drawn with its bound pixels kept. lens: may be empty.
void write_truth_of_view(const Command& command, Player& player, const View& view,
                         const LensPicture* lens, const DrawOptions& options, Frame& frame,
                         const RunContext& context);

// What a run prints on stdout: its results as lines, one by one as they come, or under --json one
// object in the end.
class Results {
 public:
  explicit Results(bool as_json) : as_json_(as_json) {}

  void wrote(const std::string& option, const std::filesystem::path& path);
  // A result under a key; `text` is what stands for it among the lines.
  void add(const std::string& key, Json value, const std::string& text);
  // Throws IoError when stdout doesn't take it, as the others do.
  void finish() const;

 private:
  bool as_json_;
  Json object_ = Json::object();
};

// Throws IoError for a result that lies in one of the bundles.
void check_apart_from_bundles(const std::filesystem::path& path, const Command& command);

// Says before any work what would keep a result from being written at its end, and refuses results
// that would overwrite what the command reads. Throws UsageError or IoError.
void check_outputs(const Command& command);

}  // namespace organbake
