// SPDX-License-Identifier: Apache-2.0
#pragma once

// Data sets of seeded random views and pokes of organs, shard by shard, with their truth.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/instruments/instrument.h"
#include "organbake/truth/lens_picture.h"
#include "organbake/truth/pixel_truth.h"
#include "organbake/warp/draw_options.h"

namespace organbake {

// From low to high, evenly.
struct SampledRange {
  double low = 0, high = 0;
};

// What a data set is made of. Schema: dataset.schema.json. Frames come in clips, in each of which
// the organ starts at rest; a shard holds whole clips of one organ.
struct DatasetSpec {
  std::string name = "dataset";
  std::uint64_t seed = 1;
  int frames = 100;        // of all organs together
  int clip_frames = 10;    // that follow each other
  int shard_frames = 100;  // at most, in one folder
  int width = 640, height = 480;
  LayerSet layers;
  int tracks = 0;                     // points of the skin followed through each clip
  std::optional<double> baseline_mm;  // two eyes
  std::optional<ScopeLens> lens;      // of a scope, in the pictures' size
  double test_share = 0.2;            // of the organs
  double time_step_s = 1.0 / 30;

  double cone_rad = 0.5;                 // of views, about the one from virtual camera 0
  SampledRange distance{0.8, 1.2};       // in multiples of the virtual cameras'
  double roll_rad = 0;                   // either way, at most
  double motion_rad = 0.1;               // of the view within a clip, at most
  int fewest_pokes = 0, most_pokes = 1;  // at once in a clip
  SampledRange depth_mm{2, 10}, radius_mm{3, 6};
  double poke_cone_rad = 0.5;  // of where pokes come from, about the view
  // What each is drawn from: a Ball pushes depth_mm in, a Grasper pulls skin as far out, a Blade
  // cuts so deep. None: balls.
  std::vector<InstrumentKind> tools;
  std::vector<DrawnLight> lights;  // one a clip; none: what each organ is made for
  SampledRange gain{1, 1};         // of linear light, one a clip
  SampledRange noise{0, 0};        // standard deviation in steps of 8 bits, one a clip
  SampledRange stiffness{1, 1};    // of the tissue, in multiples of what was baked, one a clip
};

// Throws BadDataError naming `name` and the key.
DatasetSpec dataset_spec_from_json(const std::string& text, const std::string& name);
// All of it, defaults as well: what lies in the data set.
std::string dataset_spec_to_json(const DatasetSpec& spec);

struct DatasetSummary {
  int frames = 0;
  int shards_made = 0, shards_kept = 0;  // kept: made by an earlier run
};

// Makes a data set of pokes and views of several organs, each on its own: a folder of train/ and
// test/ with shards of pictures and their truth (TruthRecorder), spec.json, card.json and the page
// index.html. A shard appears whole or not at all, so a run that was ended goes on where it was.
// The same bytes for a spec and its bundles, however often it was ended and on any number of
// threads. `generator`: the program and its version.
// Throws UsageError for a folder that holds another data set or anything else, and what playing
// and writing throw.
DatasetSummary make_dataset(const DatasetSpec& spec,
                            const std::vector<std::filesystem::path>& bundles,
                            const std::filesystem::path& folder, const std::string& generator,
                            const RunContext& context);

}  // namespace organbake
