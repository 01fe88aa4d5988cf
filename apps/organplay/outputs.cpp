// SPDX-License-Identifier: Apache-2.0
#include "outputs.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/video_pipe.h"

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

void check_writable(const fs::path& folder) {
  if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0)
    throw IoError::writing(
        folder, "cannot be written to: " + std::string(std::strerror(errno)) + "; name another");
}

void check_place(const fs::path& file) {
  const fs::path folder = fs::absolute(file_to_write(file)).parent_path();
  std::error_code error;
  if (!fs::is_directory(folder, error) && error != std::errc::permission_denied)
    throw IoError::writing(folder, "there is no such folder; make it");
  check_writable(folder);
}

// Frames and what is written beside them.
bool is_of_frames(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  if (name == "right" && entry.is_directory()) {
    return std::all_of(fs::directory_iterator(entry.path()), fs::directory_iterator(),
                       is_of_frames);
  }
  if (name == "cameras.json" || name == "scenes.jsonl") return true;
  std::vector<std::string> kinds = layer_names();
  kinds.push_back("frame");
  return (name.ends_with(".png") || name.ends_with(".exr")) &&
         std::any_of(kinds.begin(), kinds.end(),
                     [&](const std::string& kind) { return name.starts_with(kind + "_"); });
}

// A folder of frames may be replaced by new frames; anything else is the user's.
void check_replaceable(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw IoError::writing(folder, "is a file; name another folder");
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (is_of_frames(entry)) continue;
    throw IoError::writing(folder, "holds '" + entry.path().filename().string() +
                                       "', which is no frame of mine; name another folder");
  }
}

// The folder, made anew with what is missing of the way to it, or put in the place of older frames.
void check_folder(const fs::path& named) {
  fs::path folder = fs::absolute(named).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "out/" names the folder "out"
  std::error_code error;
  const auto missing = [&error](const fs::path& path) {
    return !fs::exists(path, error) && !error && path.has_relative_path();
  };
  fs::path parent = folder.parent_path();
  while (missing(parent)) parent = parent.parent_path();
  if (fs::exists(parent, error) && !fs::is_directory(parent, error))
    throw IoError::writing(parent, "is a file; name another folder");
  check_writable(parent);
  if (!fs::exists(folder)) return;
  check_replaceable(folder);
  check_writable(folder);  // or what was in it could not be removed
}

// Whether it is there or not, or behind a folder that we may not look into.
fs::path real(const fs::path& path) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(path), error);
  return error ? fs::absolute(path).lexically_normal() : real;
}

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

// The next run would find it among the frames that it is to replace.
void check_apart_from_frames(const Output& output, const Command& command) {
  const fs::path& frames = command.out_folder;
  if (frames.empty() || !lies_in(output.file, frames)) return;
  throw UsageError(std::string(output.option) + " " + output.file.string() + ": lies in --out " +
                   frames.string() + ", which is for frames alone; put it beside that folder");
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
    check_apart_from_frames(output, command);
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
  if (command.out_folder.empty()) return;
  check_apart_from_bundles(command.out_folder, command);
  check_folder(command.out_folder);
}

}  // namespace organbake
