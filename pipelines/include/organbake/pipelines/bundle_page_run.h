// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/bundle_reader.h"

namespace organbake {

// What only the bake knows, because no clock may reach a bundle. A page keeps it, so that a page
// made anew need not forget it.
struct BakeRun {
  struct Stage {
    std::string name;
    double seconds = 0;  // of the run that made its files, which may be an earlier one:
    bool cached = false;
    std::vector<std::string> warnings;
  };
  std::vector<Stage> stages;
  double seconds = 0;  // of the whole bake, without its page
};

// The run as part of a page of this bundle.
std::string run_script(const BundleReader& reader, const BakeRun& run);
// Of a page that was written for this very bundle; nothing for any other file, or none. Throws
// IoError.
std::optional<BakeRun> run_of_page(const std::filesystem::path& page, const BundleReader& reader);

// Beside the bundle, "organ" → "organ_report.html": a page tells times, which no file of a bundle
// may hold.
std::filesystem::path page_beside(const std::filesystem::path& bundle);
// The page with its player likewise, "organ" → "organ_player.html".
std::filesystem::path player_page_beside(const std::filesystem::path& bundle);
// How a report links to it.
std::string player_link(const std::filesystem::path& bundle, const std::filesystem::path& report);

}  // namespace organbake
