// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/core/version.h"
#include "organbake/options/options.h"

namespace organbake {

// What lies at an input's path, as far as its content hash is concerned: some things are more than
// the one file that names them.
enum class InputKind {
  mesh,     // one file
  volume,   // one file, a header with its data file, or a folder of DICOM slices
  cameras,  // cameras.json
  photos,   // cameras.json with the photographs that it names
  frames,   // a frame, a folder of frames, or a video
  file,     // one file of any kind
  lenses,   // a file, or the folder of a COLMAP text model
  posed,    // the same, with the images that a JSON document names, where they are there
};

struct StageInput {
  std::string name;  // of the artifact: "ct", "surface", "proxy" …
  InputKind kind = InputKind::mesh;
  std::string help;
  bool required = true;
  std::string unless = {};  // not needed when this other input is given
  // Though not required, a bake makes it when the user gives this other input.
  std::string made_from = {};
  // May come several times; each is then an input of its own, called as input_of_many() says.
  bool many = false;
  std::string flag = {};  // of the command line; empty = the name
};

// The name of the index-th of many inputs. It holds the file's own name, because results name it.
std::string input_of_many(const StageInput& input, std::size_t index,
                          const std::filesystem::path& path);

struct StageOutput {
  std::string artifact;  // what later stages ask for
  std::string file;      // in the stage's output folder
  // Not every run can tell it; later stages then do without.
  bool may_be_missing = false;
};

// Something that a stage or a bake passes over.
struct LeftOut {
  std::string what, why;
};

// What a stage tells about its run: key figures (no times, no paths: they go into bundles) and
// what it did not do, with the reason.
struct StageReport {
  std::vector<std::pair<std::string, OptionValue>> figures;
  std::vector<LeftOut> skipped;
  // Damage in an input that ended the stage early, with results that are good as far as they go:
  // they are kept, and the command then fails with exit code 65 and this message.
  std::string bad_data = {};
  // Why the result, though written, is not good enough (exit code 3); empty when it is.
  std::string quality_gate;
  // Why the stage made nothing, though its inputs are sound: a bake goes on without it, by whatever
  // else makes the same; a command of its own fails with exit code 65 and this message.
  std::string declined = {};

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

// A stage's own option struct with its description; the two live and die together.
struct StageOptions {
  std::shared_ptr<void> storage;
  OptionList list;
  std::function<StageOptions()> copy;  // the same values in a struct of their own
};

// The thin half of a stage: all that the front program must know to list it, to plan with it and to
// look its result up. The other half, `run`, lies in a module of its own (stage_module.h).
struct Stage {
  std::string name;
  std::string summary = {};
  std::vector<StageInput> inputs = {};
  std::vector<StageOutput> outputs = {};
  std::function<StageOptions()> make_options = {};
  // Written as one file (-o FILE) or as a folder (-o DIR). What a single file's stage puts below
  // kBeside in its folder lands beside FILE: for "pose.json", overlay.png as pose_overlay.png.
  bool single_file = false;
  // What most bakes have nothing for: a bake that does without it doesn't say so, unless its recipe
  // has a section for it.
  bool on_request = false;
  // Several stages make the same of the same input: a bake takes this one only where its recipe has
  // a section for it.
  bool by_section_only = false;
  static constexpr const char* kBeside = "beside";

  const StageOutput* output(const std::string& artifact) const {
    for (const StageOutput& output : outputs) {
      if (output.artifact == artifact) return &output;
    }
    return nullptr;
  }
};

// What a stage's run gets. Inputs that were not given are absent from the map.
struct StageCall {
  const void* options = nullptr;  // the struct that the stage's description made
  std::string options_json;       // the same, for documents that tell how they were made
  std::map<std::string, std::filesystem::path> inputs;
  std::filesystem::path output_folder;  // exists and is empty
  const RunContext& context;

  template <class Options>
  const Options& options_as() const {
    return *static_cast<const Options*>(options);
  }
  // All of a StageInput with `many`, in the order given; the file name that the user knows first.
  std::vector<std::pair<std::string, std::filesystem::path>> inputs_of(
      const std::string& name) const {
    std::vector<std::pair<std::string, std::filesystem::path>> found;
    for (const auto& [key, path] : inputs) {
      if (key.starts_with(name + " ")) found.emplace_back(path.filename().string(), path);
    }
    return found;
  }
  const std::filesystem::path* input(const std::string& name) const {
    const auto found = inputs.find(name);
    return found == inputs.end() ? nullptr : &found->second;
  }
};

using StageFunction = std::function<StageReport(const Stage&, const StageCall&)>;

// All stages, in the order in which a bake runs them.
const std::vector<Stage>& all_stages();
// Those of `organbake inspect`, which is a module, too, but no stage of a bake.
StageOptions inspect_options();
// Nothing when there is none of this name.
const Stage* find_stage(const std::string& name);

template <class Options>
StageOptions options_from(const Options& values) {
  auto storage = std::make_shared<Options>(values);
  OptionList list;
  bind(list, *storage);
  return {storage, list, [storage] { return options_from(*storage); }};
}

// A stage's options with their defaults, as its description makes them.
template <class Options>
StageOptions make_options() {
  return options_from(Options());
}

// Loads the module that holds a stage's run and calls it. Modules carry the heavy libraries, so
// that a program pays for VTK or CGAL only when a stage that needs them runs. Throws what the stage
// throws; a missing module or one of another build is an internal error.
StageReport run_in_module(const Stage& stage, const StageCall& call);

std::filesystem::path module_file(const std::string& stage);

}  // namespace organbake

// Put once at the end of a stage's source: the door through which the front program comes in.
#define ORGANBAKE_STAGE_MODULE(run)                                                         \
  extern "C" __attribute__((visibility("default"))) const char* organbake_stage_version() { \
    return organbake::kVersion;                                                             \
  }                                                                                         \
  extern "C" __attribute__((visibility("default"))) void organbake_stage_run(               \
      const organbake::StageCall& call, organbake::StageReport& report) {                   \
    report = run(call);                                                                     \
  }
