// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/bake_report.h"

#include <nlohmann/json.hpp>

#include "organbake/bundle/bundle_reader.h"
#include "organbake/pipelines/document.h"
#include "organbake/pipelines/schemas.h"

namespace organbake {

nlohmann::json read_bake_report(const BundleReader& reader) {
  const std::vector<std::byte> bytes = reader.read("report.json");
  const std::string name = (reader.folder() / "report.json").string();
  const auto check = [&](const std::string& text, const char* schema) {
    const Document document = Document::parse_json(text, name);
    check_document(document, schema);
    return document.json();
  };
  const nlohmann::json report =
      check({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, "bake-report");
  for (const nlohmann::json& stage : report.at("stages")) check(stage.dump(), "stage-report");
  return report;
}

}  // namespace organbake
