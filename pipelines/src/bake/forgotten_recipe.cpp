// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/forgotten_recipe.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/content_hash.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
bool is_one_of(const std::string& text, const std::array<std::string_view, N>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

bool is_volume_name(const fs::path& file) {
  constexpr std::array<std::string_view, 10> kEndings = {".nii", ".mha", ".mhd", ".nrrd", ".nhdr",
                                                         ".vti", ".dcm", ".ima", ".hdr",  ".img"};
  const std::string ending = lower_ending(file);
  const bool packed = ending == ".gz" || ending == ".bz2";
  return is_one_of(packed ? lower_ending(file.stem()) : ending, kEndings);
}

bool is_video_name(const fs::path& file) {
  constexpr std::array<std::string_view, 9> kEndings = {".mp4", ".m4v",  ".mkv", ".avi", ".mov",
                                                        ".wmv", ".webm", ".mpg", ".mpeg"};
  return is_one_of(lower_ending(file), kEndings);
}

bool holds_frames(const fs::path& folder) {
  std::error_code ignored;
  const fs::directory_iterator files(folder, ignored);
  return std::any_of(begin(files), end(files),
                     [](const auto& entry) { return is_frame_name(entry.path()); });
}

struct Given {
  std::string what, input;  // "a surface", and the recipe's input that takes it
};

Given given_by(const fs::path& file) {
  if (fs::is_directory(file))
    return holds_frames(file) ? Given{"a folder of frames", "frames"} : Given{"a folder", "ct"};
  if (is_mesh_name(file)) return {"a surface", "surface"};
  if (is_video_name(file)) return {"a video", "frames"};
  if (is_frame_name(file)) return {"a picture", "frames"};
  if (is_volume_name(file) || has_dicom_mark(file)) return {"a volume", "ct"};
  return {};
}

// One that lies beside this program, installed or built, so that the advice can be followed.
std::string recipe_for(const std::string& input) {
  const std::string name = input == "frames" ? "laparoscopy.yaml" : "liver.yaml";
  const fs::path bin = program_folder();
  for (const fs::path& folder :
       {bin / "../share/organbake/recipes", bin / "../../../pipelines/recipes"}) {
    if (fs::exists(folder / name)) return fs::weakly_canonical(folder / name).string();
  }
  return name;
}

std::string quoted(const std::string& word) {
  return word.find_first_of(" '\"()&;$") == std::string::npos ? word : "\"" + word + "\"";
}

}  // namespace

void check_is_no_input(const fs::path& file) {
  const std::string name = file.string();
  if (!fs::exists(file)) return;
  if (fs::exists(file / "manifest.json"))
    throw UsageError(name + " is a bundle, baked already; 'organplay' shows it");
  const std::string ending = lower_ending(file);
  if (ending == ".csv" || ending == ".tsv")
    throw UsageError(name + " is a table of cases, not a recipe; write: organbake batch " +
                     quoted(name) + " --recipe " + quoted(recipe_for("ct")) + " -o FOLDER");
  const Given given = given_by(file);
  if (given.input.empty()) return;
  throw UsageError(name + " is " + given.what + ", not a recipe; write: organbake bake " +
                   quoted(recipe_for(given.input)) + " --set " + quoted(given.input + "=" + name) +
                   " -o BUNDLE");
}

}  // namespace organbake
