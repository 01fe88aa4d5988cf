// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace organbake {

// What became of one case.
struct BatchRow {
  std::string name;
  std::string status;  // "written", "unchanged", "failed", "not started", "left out"
  int exit_code = 0;
  double seconds = 0;
  double peak_mb = 0;
  std::map<std::string, double> figures;  // "decimate.rms_mm" …: what tells a good bake from a bad
  std::vector<std::string> warnings;      // of its stages, as the bake told them
  std::string error;    // the worker's last words, when it failed; why it is left out
  std::string picture;  // of the organ, relative to the batch's folder; may be empty
  std::string page;     // with its player, likewise
};

// The figures of a bundle's report.json that the batch shows.
std::map<std::string, double> key_figures(const nlohmann::json& bake_report);

nlohmann::json batch_json(const std::string& recipe, const std::vector<BatchRow>& rows);
// The rows of a batch.json that has been checked.
std::vector<BatchRow> rows_of(const nlohmann::json& batch);
// The rows of all shards of a batch in the order of its cases: every shard holds every n-th.
std::vector<BatchRow> interleaved(const std::vector<std::vector<BatchRow>>& shards);
std::string batch_csv(const std::vector<BatchRow>& rows);
// One page, pictures beside it, the worst first: failures, then what was warned of, then the
// farthest proxies.
std::string batch_page(const std::string& recipe, std::vector<BatchRow> rows);

}  // namespace organbake
