// SPDX-License-Identifier: Apache-2.0
#pragma once

// The truth beside a script's frames, as files.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "organbake/player/player.h"
#include "organbake/player/script.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"

namespace organbake {

// Pieces of work that write one file each, from planes of their own: whoever makes them may run
// them later, and from any thread.
using WriteJob = std::function<void()>;

// Of the layers but for flow, as <before>depth<after>.exr, normals, id and weight likewise, and
// the mask as PNG of 8-bit labels. Channels: Z, as floats of 24 bits (to 0.001 mm
// at 100 mm); X Y Z; organ face b1 b2 h (face 4294967295 and the rest 0 at the background); weight.
// The jobs throw IoError.
std::vector<WriteJob> layer_jobs(const std::filesystem::path& folder, const std::string& before,
                                 const std::string& after, const LayerSet& layers,
                                 const PixelTruth& truth);

struct TruthOptions {
  LayerSet layers;
  std::optional<double> baseline_mm;     // draw a right eye, too, so far along the view's x axis
  std::vector<std::string> instruments;  // their names
  int tracks = 0;                        // points of the skin to follow through each clip; 0: none
  // Pictures as a scope shows them; those that are added are its pinhole's. Empty: as they are.
  std::shared_ptr<const LensPicture> lens = {};
  // Runs the writing of files, now or later; empty: now.
  std::function<void(WriteJob)> run = {};

  // Throws UsageError for a baseline that is none, and for more organs or tools than labels.
  void check(std::size_t organs) const;
};

// A part of what is recorded that has nothing to do with the part before.
struct TruthClip {
  int first_frame = 0;                   // its frames are numbered on from here
  std::vector<std::string> instruments;  // their names
  std::optional<DrawnLight> light = {};  // as DrawOptions has it
  // Exposes the right eye's picture of a frame, from any thread; may be empty.
  std::function<void(int frame, Rgb8Image& picture)> expose_right = {};
};

// The same view from further to the right, as the other of two eyes with parallel axes. Those of
// 3D laparoscopes are about 5 mm apart (Surg. Endosc. 22:2396, 2008).
View right_eye(const View& view, double baseline_mm);
inline constexpr double kUsualBaseline_mm = 5;
// Throws UsageError for a baseline that makes no stereo: the right eye lies to the right of the
// left one, and far enough for anything to look different.
inline constexpr double kNarrowestBaseline_mm = 0.1, kWidestBaseline_mm = 1000;
void check_baseline(double baseline_mm);

// Writes the truth of a script's frames into a folder that the caller makes and commits: by frame
// the layers (layer_jobs()) as depth_0000.exr and so on, for the sequence cameras.json and
// scenes.jsonl; and by clip tracks_0000.npz (its first frame's number), the points of the skin that
// were asked for, of those that its first frame shows, evenly over its pixels: points (n, frames,
// 2) float32, px, occluded (n, frames) bool, as TAP-Vid has them but for the unit, and xyz_mm (n,
// frames, 3) float32, camera mm. The right eye's frames and layers, under the same names and with a
// cameras.json of their own, lie in the folder "right".
class TruthRecorder {
 public:
  TruthRecorder(std::filesystem::path folder, const TruthOptions& options, const DrawOptions& draw);
  ~TruthRecorder();

  // What comes now is another clip: flow begins anew.
  void begin(const TruthClip& clip);
  // Frames in order. Throws IoError, and what drawing the right eye throws.
  void add(Player& player, const PlayedScene& scene);
  // What is only known at the end.
  void finish();

 private:
  struct Eye;
  TruthOptions options_;
  DrawOptions draw_;
  std::filesystem::path folder_;
  std::vector<std::unique_ptr<Eye>> eyes_;
  std::string scenes_;
  TruthClip clip_;
};

}  // namespace organbake
