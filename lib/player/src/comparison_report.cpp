// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "organbake/bundle/json_fields.h"
#include "organbake/core/text.h"
#include "organbake/player/comparison_table.h"

namespace organbake {
namespace {

Json errors_json(const PixelErrors& e) {
  return {
      {"mean_px", e.mean_px}, {"p99_px", e.p99_px}, {"max_px", e.max_px}, {"vertices", e.vertices}};
}

Json steps_json(const SeamSteps& s) {
  return {
      {"frame", s.frame}, {"truth", s.truth}, {"largest_excess", s.excess}, {"places", s.places}};
}

std::string cell(const std::string& text, std::size_t width) {
  return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

}  // namespace

std::string comparison_json(const ComparisonTable& table) {
  Json rows = Json::array();
  for (const ComparisonRow& row : table.rows) {
    rows.push_back(
        {{"angle_rad", row.angle_rad},
         {"state", row.poked ? "poked" : "rest"},
         {"visible_vertices", row.projection.visible},
         {"without_map", row.projection.without_map},
         {"image_based", errors_json(row.projection.image_based)},
         {"polygons", errors_json(row.projection.polygons)},
         {"displayed",
          {{"point", errors_json(row.displayed.point)},
           {"sample", errors_json(row.displayed.sample)},
           {"paper_warp", errors_json(row.displayed_paper)},
           {"polygons", errors_json(row.displayed_polygons)}}},
         {"psnr_db", row.picture.psnr_db},
         {"ssim", row.picture.ssim},
         {"inner_pixels", row.inner_pixels},
         {"holes_before_fill", row.holes_before_fill},
         {"holes", row.picture.holes},
         {"paper_warp",
          {{"psnr_db", row.paper.psnr_db}, {"ssim", row.paper.ssim}, {"holes", row.paper.holes}}},
         {"ideal_resampler", {{"psnr_db", row.ideal.psnr_db}, {"ssim", row.ideal.ssim}}},
         {"smooth_ideal_resampler",
          {{"psnr_db", row.smooth_ideal.psnr_db}, {"ssim", row.smooth_ideal.ssim}}},
         {"edge_step_8bit", steps_json(row.seams)}});
  }
  return json_text({{"schema", "organbake/comparison/1"},
                    {"rows", rows},
                    {"camera_switches", table.switches},
                    {"camera_switch_step_8bit", steps_json(table.camera_switch)}});
}

std::string comparison_text(const ComparisonTable& table) {
  std::string text =
      "state  angle     image-based px (mean, max)  no map   polygons px (mean, max)   PSNR dB "
      "(paper's warp, ideal)  displayed px  "
      "holes  edge step (frame, truth, excess)\n";
  for (const ComparisonRow& row : table.rows) {
    const auto& image = row.projection.image_based;
    const auto& polygons = row.projection.polygons;
    const double no_map = 100.0 * double(row.projection.without_map) /
                          double(std::max<std::size_t>(row.projection.visible, 1));
    text += std::string(row.poked ? "poked" : "rest ") + cell(to_text(row.angle_rad, 6), 10) +
            cell(to_text(image.mean_px, 4), 16) + cell(to_text(image.max_px, 3), 10) +
            cell(to_text(no_map, 1) + " %", 12) + cell(to_text(polygons.mean_px, 2), 14) +
            cell(to_text(polygons.max_px, 1), 8) + cell(to_text(row.picture.psnr_db, 2), 11) +
            cell("(" + to_text(row.paper.psnr_db, 2) + ", " + to_text(row.smooth_ideal.psnr_db, 2) +
                     ")",
                 22) +
            cell(to_text(row.displayed.point.mean_px, 3), 14) +
            cell(std::to_string(row.picture.holes), 7) + cell(to_text(row.seams.frame, 1), 10) +
            cell(to_text(row.seams.truth, 1), 8) + cell(to_text(row.seams.excess, 1), 8) + "\n";
  }
  return text + "camera switches on the orbit: " + std::to_string(table.switches) +
         ", largest step " + to_text(table.camera_switch.frame, 2) + "/255 (truth " +
         to_text(table.camera_switch.truth, 2) + ")\n";
}

}  // namespace organbake
