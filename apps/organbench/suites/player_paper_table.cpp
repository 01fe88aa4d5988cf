// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/text.h"
#include "organbake/player/comparison_table.h"
#include "suites/player_parts.h"

namespace organbake {
namespace {

// The paper, Table 1: mean projection error of an 80-face proxy of a phantom of 80,744 faces.
struct PaperRow {
  double angle_rad, image_based_px, polygons_px;
};
constexpr PaperRow kPaperTable[] = {{0.706, 1.41, 9.14},
                                    {0.868, 1.52, 3.03},
                                    {1.918, 2.34, 16.1},
                                    {2.447, 2.21, 10.1},
                                    {2.449, 1.20, 16.3}};
constexpr double kSameAngle_rad = 5e-4;  // the paper's angles have three decimals

const ComparisonRow* find_row(const ComparisonTable& table, double angle_rad, bool poked) {
  const auto found = std::find_if(table.rows.begin(), table.rows.end(), [&](const auto& row) {
    return row.poked == poked && std::abs(row.angle_rad - angle_rad) <= kSameAngle_rad;
  });
  return found == table.rows.end() ? nullptr : &*found;
}

std::vector<Quantity> row_of(const PaperRow& paper, const ComparisonRow& fitted,
                             const ComparisonRow& naive) {
  return {{"the paper, image-based", "px", paper.image_based_px},
          {"the paper, polygons", "px", paper.polygons_px},
          {"naive proxy, image-based", "px", naive.projection.image_based.mean_px},
          {"naive proxy, polygons", "px", naive.projection.polygons.mean_px},
          {"ours, image-based", "px", fitted.projection.image_based.mean_px},
          {"ours, polygons", "px", fitted.projection.polygons.mean_px}};
}

std::vector<Quantity> mean_row(const std::vector<std::vector<Quantity>>& rows) {
  std::vector<Quantity> mean = rows.front();
  for (std::size_t column = 0; column < mean.size(); ++column) {
    mean[column].value = 0;
    for (const auto& row : rows) mean[column].value += row[column].value / double(rows.size());
  }
  return mean;
}

}  // namespace

void rebuild_paper_table(Bench& bench, const ComparisonTable& fitted,
                         const ComparisonTable& naive) {
  for (const bool poked : {false, true}) {
    const std::string task = std::string("The paper's Table 1, ") +
                             (poked ? "the organ poked" : "the organ at rest") +
                             ": mean projection error by viewing angle";
    std::vector<std::vector<Quantity>> rows;
    const auto add = [&](const std::string& subject, const std::vector<Quantity>& errors) {
      bench.add(Point{task, subject, false, {}, {}, errors});
    };
    for (const PaperRow& paper : kPaperTable) {
      const ComparisonRow* ours = find_row(fitted, paper.angle_rad, poked);
      const ComparisonRow* theirs = find_row(naive, paper.angle_rad, poked);
      if (!ours || !theirs) continue;  // a quick run looks from fewer angles
      rows.push_back(row_of(paper, *ours, *theirs));
      add(to_text(paper.angle_rad, 3) + " rad", rows.back());
    }
    if (!rows.empty()) add("mean", mean_row(rows));
  }
}

}  // namespace organbake
