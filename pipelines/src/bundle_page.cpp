// SPDX-License-Identifier: GPL-3.0-or-later
// One page about a bundle, with its pictures inside: what gives reason to look first, then errors,
// coverage, maps and origin. All of it is the bundle's own, but for what stages said while it was
// baked, which may name files of that machine and stands in no bundle.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/sha256.h"
#include "organbake/core/text.h"
#include "organbake/pipelines/bake_report.h"
#include "organbake/pipelines/documents.h"

namespace organbake {
namespace {

using Json = nlohmann::json;

constexpr const char* kBundlePageStyle =
    ".warnings{background:#fff3d6;border-left:4px solid #d08700;padding:.6rem 1.2rem;margin:1rem "
    "0}.fine{color:#00702f}.sheet{display:flex;flex-wrap:wrap;gap:.9rem}figure{margin:0;"
    "font-size:12px;color:#444}figure>div{display:flex;gap:2px;margin-bottom:.2rem}"
    "figure img{image-rendering:pixelated;width:112px;height:auto;background:#15161a}"
    ".proxies{display:flex;flex-wrap:wrap;gap:1rem}details{margin:.3rem 0}"
    "td.bar{padding:0 .7rem;text-align:left}.text{text-align:left!important}";

// The figures that tell a good stage from a bad one; the others stand in the full list.
const std::map<std::string, std::vector<const char*>> kShownFigures = {
    {"shade", {"frames_shaded", "depth_unit"}},
    {"motion",
     {"verdict", "frames_posed", "points", "mean_error_px", "focal_px", "focal_sd_px",
      "surface_area_mm2"}},
    {"isosurface", {"faces", "volume_ml"}},
    {"decimate", {"faces", "rms_mm", "max_mm", "volume_change"}},
    {"mechanics", {"springs", "mass_kg"}},
    {"place", {"cameras", "seen_by_2_share", "view_gap_mean"}},
    {"register", {"registered", "uncertainties_mm"}},
    {"capture", {"bound_in_prism", "bound_by_fallback", "largest_height_mm"}}};

std::string value_text(const Json& value) {
  if (value.is_number_integer()) return value.dump();
  if (value.is_number()) return page_number(value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_array()) return value.dump();
  return joined(value, ", ", value_text);
}

std::string errors_of(const Json& stage) {
  std::string text;
  const auto shown = kShownFigures.find(stage.at("stage"));
  if (shown == kShownFigures.end()) return text;
  for (const char* figure : shown->second)
    if (const auto found = stage.at("figures").find(figure); found != stage.at("figures").end())
      text += (text.empty() ? "" : ", ") + (figure + (" " + value_text(*found)));
  return text;
}

std::string bar(double share) {
  constexpr double kWidth = 220;
  return "<td class=\"bar\"><svg width=\"220\" height=\"12\"><rect width=\"" +
         to_text(kWidth * std::clamp(share, 0.0, 1.0), 1) +
         "\" height=\"12\" fill=\"#3d9a6c\"/></svg></td>";
}

std::string warnings_section(const Json& report, const SaidWarnings& said) {
  std::vector<std::string> warnings;
  for (const Json& stage : report.at("stages")) {
    const std::string name = stage.at("stage");
    const auto own = said.find(name);
    for (const std::string& text :
         stage_warnings(stage, own == said.end() ? std::vector<std::string>() : own->second))
      warnings.push_back(name + ": " + text);
  }
  if (warnings.empty()) return "<p class=\"fine\">No warnings.</p>\n";
  std::string html = "<div class=\"warnings\"><b>" + std::to_string(warnings.size()) +
                     (warnings.size() == 1 ? " warning" : " warnings") + "</b><ul>";
  for (const std::string& warning : warnings) html += "<li>" + escape_html(warning) + "</li>";
  return html + "</ul></div>\n";
}

std::string proxies_section(const Bundle& frame, const BundlePictures& pictures) {
  std::string html = "<h2>The proxy over the surface</h2><p class=\"quiet\">" +
                     std::to_string(frame.proxy.faces.size()) +
                     " faces; the surface as baked</p><div class=\"proxies\">";
  for (std::size_t i = 0; i < pictures.proxies_svg.size(); ++i) {
    html += "<figure>" + pictures.proxies_svg[i] + "camera " +
            std::to_string(pictures.proxy_cameras[i]) + "</figure>";
  }
  return html + "</div>\n";
}

std::string figures_of(const Json& stage) {
  std::string html =
      "<details><summary>" + escape_html(stage.at("stage")) + ": all figures</summary><table>";
  for (const auto& [name, value] : stage.at("figures").items())
    html += "<tr>" + html_cell(name) + html_cell(value_text(value)) + "</tr>";
  return html + "</table></details>";
}

std::string stages_section(const Json& report) {
  std::string html = "<h2>Stages</h2><table><tr><th>stage</th><th class=\"text\">figures</th></tr>";
  for (const Json& stage : report.at("stages"))
    html += "<tr>" + html_cell(stage.at("stage")) + "<td class=\"text\">" +
            escape_html(errors_of(stage)) + "</td></tr>";
  html += "</table>\n";
  for (const Json& stage : report.at("stages")) html += figures_of(stage);
  return html;
}

std::string coverage_section(const Json& report) {
  std::string rows;
  for (const Json& stage : report.at("stages")) {
    if (stage.at("stage") != "place") continue;
    const Json& figures = stage.at("figures");
    for (const auto& [figure, text] :
         {std::pair{"seen_by_1_share", "of the reachable area seen by a camera"},
          std::pair{"seen_by_2_share", "… by two"}, std::pair{"seen_by_3_share", "… by three"},
          std::pair{"reachable_share", "of the surface that a view can reach"}}) {
      if (!figures.contains(figure) || !figures.at(figure).is_number()) continue;
      const double share = figures.at(figure);
      rows += "<tr>" + html_cell(text) + html_cell(page_number(100 * share) + " %") + bar(share) +
              "</tr>";
    }
  }
  return rows.empty() ? "" : "<h2>Coverage</h2><table>" + rows + "</table>\n";
}

std::string range_text(const TexelRange& range) {
  return page_number(range.least) + " … " + page_number(range.most) + " mm";
}

std::string sheet_section(const Bundle& frame, const BundlePictures& pictures) {
  const Intrinsics& map = frame.cameras.cameras.front().intrinsics;
  std::string html =
      "<h2>Maps</h2><p class=\"quiet\">Colour, depth (near is light) and microstructure (red above "
      "the proxy, blue below, full at " +
      page_number(pictures.height_limit_mm) + " mm); " + std::to_string(map.width) + " × " +
      std::to_string(map.height) + " texels</p><div class=\"sheet\">";
  for (std::size_t c = 0; c < pictures.thumbnails.size(); ++c) {
    const MapThumbnails& small = pictures.thumbnails[c];
    const std::string name = "camera " + std::to_string(c);
    html += "<figure><div>" + html_picture(small.color, name + ", colour") +
            html_picture(small.depth, name + ", depth") +
            html_picture(small.micro, name + ", microstructure") + "</div>" + name + ", " +
            page_number(100 * small.filled_share) + " % filled<br>depth " +
            range_text(small.depth_mm) + "<br>height " + range_text(small.height_mm) + "</figure>";
  }
  return html + "</div>\n";
}

std::string skipped_section(const Json& report) {
  std::string rows;
  const auto row = [&](const std::string& stage, const Json& item) {
    rows += "<tr>" + html_cell(stage) + "<td class=\"text\">" +
            escape_html(item.at("what").get<std::string>()) + "</td><td class=\"text\">" +
            escape_html(item.at("why").get<std::string>()) + "</td></tr>";
  };
  for (const Json& item : report.at("left_out")) row("bake", item);
  for (const Json& stage : report.at("stages"))
    for (const Json& item : stage.at("skipped")) row(stage.at("stage"), item);
  if (rows.empty()) return "";
  return "<details><summary>Skipped, and why</summary><table><tr><th>stage</th><th "
         "class=\"text\">what</th><th class=\"text\">why</th></tr>" +
         rows + "</table></details>\n";
}

std::string manifest_hash(const BundleReader& reader) {
  return sha256_hex(read_file(reader.folder() / "manifest.json"));
}

std::string origin_section(const BundleReader& reader) {
  const Manifest& manifest = reader.manifest();
  std::string html = "<h2>Origin</h2><table><tr>" + html_cell("manifest.json") +
                     html_cell("SHA-256 " + manifest_hash(reader)) + "</tr>";
  for (const auto& [role, hash] : manifest.input_hashes)
    html += "<tr>" + html_cell(role) + html_cell("SHA-256 " + hash) + "</tr>";
  for (const auto& [stage, seed] : manifest.seeds)
    html += "<tr>" + html_cell(stage) + html_cell("seed " + std::to_string(seed)) + "</tr>";
  return html + "</table><details><summary>the recipe, every option resolved</summary><pre>" +
         escape_html(Json::parse(manifest.recipe_json).dump(2)) + "</pre></details>\n";
}

std::string title_line(const Bundle& frame) {
  std::uint64_t bytes = 0;
  for (const BundleFile& file : frame.manifest.files) bytes += file.bytes;
  return "<h1>" + escape_html(frame.manifest.name) + "</h1><p class=\"quiet\">" +
         escape_html(frame.manifest.generator) + " · " +
         std::to_string(frame.cameras.cameras.size()) + " cameras · " +
         page_number(static_cast<double>(bytes) / 1e6) + " MB</p>\n";
}

std::string player_line(const std::string& player) {
  return player.empty() ? "" : "<p>" + html_link(player, "Poke it in a page") + "</p>\n";
}

}  // namespace

std::string bundle_page(const BundleReader& reader, const SaidWarnings& said,
                        const std::string& player) {
  const Bundle frame = reader.read_frame();
  const Json report = read_bake_report(reader);
  const BundlePictures pictures = bundle_pictures(reader, frame);
  return html_page(frame.manifest.name + ": bake report", kBundlePageStyle,
                   title_line(frame) + player_line(player) + warnings_section(report, said) +
                       coverage_section(report) + sheet_section(frame, pictures) +
                       proxies_section(frame, pictures) + stages_section(report) +
                       skipped_section(report) + origin_section(reader));
}

namespace {

std::filesystem::path beside(const std::filesystem::path& bundle, const char* ending) {
  std::filesystem::path folder = bundle.lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "organ/"
  // "." has no name of its own to add to.
  if (folder.filename() == "." || folder.filename() == ".." || folder.filename().empty())
    folder = std::filesystem::absolute(bundle).lexically_normal().parent_path();
  return folder.parent_path() / (folder.filename().string() + ending);
}

}  // namespace

std::filesystem::path page_beside(const std::filesystem::path& bundle) {
  return beside(bundle, "_report.html");
}

std::filesystem::path player_page_beside(const std::filesystem::path& bundle) {
  return beside(bundle, "_player.html");
}

std::string player_link(const std::filesystem::path& bundle, const std::filesystem::path& report) {
  const auto player = std::filesystem::absolute(player_page_beside(bundle));
  return player.lexically_proximate(std::filesystem::absolute(report).parent_path())
      .generic_string();
}

bool is_page_of(const std::filesystem::path& page, const BundleReader& reader) {
  return std::filesystem::is_regular_file(page) &&
         read_text_file(page).find(manifest_hash(reader)) != std::string::npos;
}

}  // namespace organbake
