// SPDX-License-Identifier: Apache-2.0
#include "dataset_run.h"

#include <filesystem>
#include <string>

#include "loaded_module.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/version.h"
#include "organbake/dataset/dataset.h"
#include "results.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

// JSON as it is; of YAML the same document as JSON.
std::string spec_text(const fs::path& file) {
  const std::string text = read_text_file(file);
  const std::string ending = lower_ending(file);
  if (ending != ".yaml" && ending != ".yml") return text;
  using Convert = void (*)(const std::string&, const std::string&, std::string&);
  const auto convert = reinterpret_cast<Convert>(
      load_door({"organplay_yaml.so", "YAML", "YAML cannot be read",
                 "write the data set's SPEC as JSON instead, with that ending"},
                "organplay_json_of_yaml"));
  std::string json;
  convert(text, file.string(), json);
  return json;
}

}  // namespace

void run_dataset(const Command& command, const RunContext& context) {
  const DatasetSpec spec =
      dataset_spec_from_json(spec_text(command.dataset), command.dataset.string());
  for (const fs::path& bundle : command.bundles) {
    const fs::path way =
        fs::weakly_canonical(command.frame_file).lexically_relative(fs::weakly_canonical(bundle));
    if (!way.empty() && *way.begin() != "..")
      throw IoError::writing(
          command.frame_file,
          "lies in the bundle " + bundle.string() + ", which would be damaged; name another place");
  }
  const DatasetSummary made = make_dataset(spec, command.bundles, command.frame_file,
                                           std::string("organplay ") + kVersion, context);
  Results results(command.shared.json);
  results.wrote("dataset", command.frame_file);
  context.info(std::to_string(made.frames) + " frames, " + std::to_string(made.shards_made) +
               " shards made now and " + std::to_string(made.shards_kept) + " before");
  results.finish();
}

}  // namespace organbake
