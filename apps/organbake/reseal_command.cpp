// SPDX-License-Identifier: GPL-3.0-or-later
#include <filesystem>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/bundle/reseal.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

std::string listed(const std::vector<std::string>& files) {
  std::string text;
  for (const std::string& file : files) text += (text.empty() ? "" : ", ") + file;
  return text;
}

}  // namespace

int run_reseal(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "reseal BUNDLE",
      "Takes over images of a bundle that were edited by hand (cam_…/*.exr, base.exr; same size, "
      "same channels): after every check they get new checksums, and the manifest lists them.",
      {}, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake reseal' needs a bundle");
  const std::filesystem::path folder = words->front();
  const ResealedBundle resealed = reseal(folder);
  // The one file that is written, and renamed into place: the bundle is the old or the new one.
  if (!resealed.changed.empty()) {
    write_file_atomically(folder / "manifest.json", manifest_to_json(resealed.manifest));
  }
  const std::string what =
      resealed.changed.empty() ? "ok, nothing was changed" : "resealed " + listed(resealed.changed);
  session.print_result(words->front() + ": " + what,
                       {{"path", words->front()}, {"changed", resealed.changed}});
  return 0;
}

}  // namespace organbake
