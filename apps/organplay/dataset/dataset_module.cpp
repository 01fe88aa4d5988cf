// SPDX-License-Identifier: Apache-2.0
#include "organbake/dataset/dataset.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/version.h"
#ifdef ORGANPLAY_READS_YAML
#include "organbake/pipelines/document.h"
#endif

namespace organbake {
namespace {
namespace fs = std::filesystem;

// JSON as it is; of YAML the same document as JSON.
std::string spec_text(const fs::path& file) {
  const std::string text = read_text_file(file);
  const std::string ending = lower_ending(file);
  if (ending != ".yaml" && ending != ".yml") return text;
#ifdef ORGANPLAY_READS_YAML
  return Document::parse_yaml(text, file.string()).json().dump();
#else
  throw UsageError(
      "this organplay was built without YAML; write the data set's SPEC as JSON instead, with that "
      "ending");
#endif
}

}  // namespace
}  // namespace organbake

// Makes the data set of a spec's file in a folder, and tells of it in one line.
extern "C" __attribute__((visibility("default"))) void organplay_make_dataset(
    const std::filesystem::path& spec, const std::vector<std::filesystem::path>& bundles,
    const std::filesystem::path& folder, const organbake::RunContext& context, std::string& told) {
  using namespace organbake;
  const DatasetSummary made =
      make_dataset(dataset_spec_from_json(spec_text(spec), spec.string()), bundles, folder,
                   std::string("organplay ") + kVersion, context);
  told = std::to_string(made.frames) + " frames, " + std::to_string(made.shards_made) +
         " shards made now and " + std::to_string(made.shards_kept) + " before";
}
