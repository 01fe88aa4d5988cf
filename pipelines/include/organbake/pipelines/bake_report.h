// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/run_context.h"

namespace organbake {

// Stages name their options and inputs as their own commands take them: "--largest 2 keeps one
// more". The same text for a bake, which takes them by --set: "--set isosurface.largest=2 keeps …".
std::string in_bake_words(const std::string& stage, const std::string& text);

// The one list of what gives reason to look at a stage's result before the organ is used: what it
// `said` while it ran, the damage and the gate of its report (schema stage-report), and figures
// beyond what a good bake has. Whole sentences, each once, in a bake's words unless the stage ran
// alone.
std::vector<std::string> stage_warnings(const nlohmann::json& stage_report,
                                        const std::vector<std::string>& said = {},
                                        bool in_bake = true);

// Of all stages of a bundle's report.json (schema bake-report), the stage's name first. What was
// said while they ran is not in there: it may name files of the machine that baked.
std::vector<std::string> bake_warnings(const nlohmann::json& bake_report);

// A bundle's report.json, held against its schema and its stages' own: a bundle may come from
// anywhere, and its report is no part of what the reader checks. Throws NoInputError or
// BadDataError.
nlohmann::json read_bake_report(const BundleReader& reader);

// Smallest and largest value among a map's texels; both 0 when it shows nothing.
struct TexelRange {
  double least = 0, most = 0;
};

// One camera's maps, reduced to small pictures of at most kThumbnailSide pixels a side.
struct MapThumbnails {
  Rgb8Image color, depth, micro;
  TexelRange depth_mm, height_mm;  // of the full maps
  double filled_share = 0;         // of the texels, those that show the organ
};
inline constexpr int kThumbnailSide = 112;

// Near is light in `depth`. In `micro` the surface stands above the proxy where it is red, below it
// where it is blue, and lies on it where it is white; full colour is height_limit_mm.
MapThumbnails map_thumbnails(const CameraMaps& maps, double height_limit_mm);

struct BundlePictures {
  std::vector<MapThumbnails> thumbnails;  // by camera
  double height_limit_mm = 0;
  // Of camera 0, and of the one that looks most against it, if there is another.
  std::vector<std::string> proxies_svg;
  std::vector<std::size_t> proxy_cameras;
};

// Reads all maps of a bundle, two or three at a time. Throws BadDataError for a damaged one.
BundlePictures bundle_pictures(const BundleReader& reader, const Bundle& frame);

// What stages said while a bundle was baked, by their names.
using SaidWarnings = std::map<std::string, std::vector<std::string>>;

// One page about a bundle, with all its pictures inside: warnings first, the proxy over the
// surface, the errors of each stage, coverage, the maps of each camera, what was skipped and why.
// `player`, unless empty, is the file to link to as the page with the bundle's player. Throws
// BadDataError for a damaged bundle.
std::string bundle_page(const BundleReader& reader, const SaidWarnings& said,
                        const std::string& player);
// Whether a file is a page of this very bundle.
bool is_page_of(const std::filesystem::path& page, const BundleReader& reader);

// Beside the bundle, "organ" → "organ_report.html".
std::filesystem::path page_beside(const std::filesystem::path& bundle);
// The page with its player likewise, "organ" → "organ_player.html".
std::filesystem::path player_page_beside(const std::filesystem::path& bundle);
// How a report links to it.
std::string player_link(const std::filesystem::path& bundle, const std::filesystem::path& report);

}  // namespace organbake
