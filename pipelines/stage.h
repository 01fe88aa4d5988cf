// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/run_context.h"
#include "pipelines/options.h"

namespace organbake {

// What lies at an input's path, as far as its content hash is concerned: some things are more than
// the one file that names them.
enum class InputKind {
  mesh,     // one file
  volume,   // one file, a header with its data file, or a folder of DICOM slices
  cameras,  // cameras.json
  photos,   // cameras.json with the photographs that it names
  frames,   // a frame, a folder of frames, or a video
};

struct StageInput {
  std::string name;  // of the artifact: "ct", "surface", "proxy" …
  InputKind kind = InputKind::mesh;
  std::string help;
  bool required = true;
  std::string unless = {};  // not needed when this other input is given
};

struct StageOutput {
  std::string artifact;  // what later stages ask for
  std::string file;      // in the stage's output folder
};

// What a stage tells about its run: key figures (no times, no paths: they go into bundles) and
// what it did not do, with the reason.
struct StageReport {
  std::vector<std::pair<std::string, OptionValue>> figures;
  struct Skipped {
    std::string what, why;
  };
  std::vector<Skipped> skipped;
  // Damage in an input that ended the stage early, with results that are good as far as they go:
  // they are kept, and the command then fails with exit code 65 and this message.
  std::string bad_data = {};

  // Counts, measures, texts, lists: whatever an OptionValue can hold.
  template <class T>
  void add(std::string name, const T& value) {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      figures.emplace_back(std::move(name), static_cast<std::int64_t>(value));
    } else if constexpr (std::is_convertible_v<T, std::string>) {
      figures.emplace_back(std::move(name), std::string(value));
    } else {
      figures.emplace_back(std::move(name), value);
    }
  }
};

// An option struct with its description; the two live and die together.
struct StageOptions {
  std::shared_ptr<void> storage;
  OptionList list;
};

// The thin half of a stage: all that the front program must know to list it, to plan with it and to
// look its result up. The other half, `run`, lies in a module of its own (stage_module.h).
struct Stage {
  std::string name;
  int version = 1;  // raise it when the same options and inputs give other bytes
  std::string summary = {};
  std::vector<StageInput> inputs = {};
  std::vector<StageOutput> outputs = {};
  std::function<StageOptions()> make_options = {};
  // Written as one file (-o FILE) or as a folder (-o DIR).
  bool single_file = false;

  const StageOutput* output(const std::string& artifact) const {
    for (const StageOutput& output : outputs) {
      if (output.artifact == artifact) return &output;
    }
    return nullptr;
  }
};

// What a stage's run gets. Inputs that were not given are absent from the map.
struct StageCall {
  std::string options_json;
  std::map<std::string, std::filesystem::path> inputs;
  std::filesystem::path output_folder;  // exists and is empty
  const RunContext& context;

  const std::filesystem::path* input(const std::string& name) const {
    const auto found = inputs.find(name);
    return found == inputs.end() ? nullptr : &found->second;
  }
};

using StageFunction = std::function<StageReport(const Stage&, const StageCall&)>;

// All stages, in the order in which a bake runs them.
const std::vector<Stage>& all_stages();
// Nothing when there is none of this name.
const Stage* find_stage(const std::string& name);

}  // namespace organbake
