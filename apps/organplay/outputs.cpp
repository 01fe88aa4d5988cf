// SPDX-License-Identifier: Apache-2.0
#include "outputs.h"

#include <algorithm>
#include <vector>

#include "core/error.h"
#include "core/file_ending.h"
#include "core/files.h"
#include "video_pipe.h"

namespace organbake {
namespace {
namespace fs = std::filesystem;

struct Output {
  const char* option;
  fs::path file;
  std::vector<std::string> endings;
};

std::string any_of(const std::vector<std::string>& endings) {
  std::string text = endings.front();
  for (std::size_t i = 1; i < endings.size(); ++i)
    text += (i + 1 < endings.size() ? ", " : " or ") + endings[i];
  return text;
}

void check_ending(const Output& output) {
  const auto& endings = output.endings;
  if (std::find(endings.begin(), endings.end(), lower_ending(output.file)) != endings.end()) return;
  throw UsageError(std::string(output.option) + " " + output.file.string() + ": is written as " +
                   any_of(endings) + "; give it that ending");
}

void check_place(const fs::path& file) {
  const fs::path folder = fs::absolute(file_to_write(file)).parent_path();
  if (!fs::is_directory(folder)) throw IoError::writing(folder, "there is no such folder; make it");
}

// Whether it is there or not.
fs::path real(const fs::path& path) { return fs::weakly_canonical(fs::absolute(path)); }

// Whether the path, there or not, lies in the folder or is it.
bool lies_in(const fs::path& path, const fs::path& folder) {
  const fs::path way = real(path).lexically_relative(real(folder));
  return !way.empty() && *way.begin() != "..";
}

void check_apart_from_bundles(const fs::path& path, const Command& command) {
  for (const fs::path& bundle : command.bundles) {
    if (lies_in(path, bundle))
      throw IoError::writing(path, "lies in the bundle " + bundle.string() +
                                       ", which would be damaged; name another place");
  }
}

bool same(const fs::path& a, const fs::path& b) {
  return !a.empty() && !b.empty() && real(a) == real(b);
}

}  // namespace

void check_outputs(const Command& command) {
  std::vector<Output> outputs = {{"-o", command.frame_file, {".png"}},
                                 {"--sheet", command.sheet, {".png"}},
                                 {"--report", command.report, {".json"}},
                                 {"--video", command.video, VideoPipe::endings()}};
  std::erase_if(outputs, [](const Output& output) { return output.file.empty(); });
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const Output& output = outputs[i];
    check_ending(output);
    check_place(output.file);
    check_apart_from_bundles(output.file, command);
    if (same(output.file, command.script))
      throw UsageError(std::string(output.option) + " " + output.file.string() +
                       ": is the script itself; name another file");
    for (std::size_t k = 0; k < i; ++k) {
      if (same(output.file, outputs[k].file))
        throw UsageError(std::string(outputs[k].option) + " and " + output.option +
                         " name the same file; name two");
    }
  }
  if (!command.out_folder.empty()) check_apart_from_bundles(command.out_folder, command);
}

}  // namespace organbake
