// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/schemas.h"

namespace organbake {

int run_schema(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(
      arguments, "schema [NAME]",
      "Prints the JSON Schema of a kind of document, or lists the kinds there are.", {}, 1);
  if (!words) return 0;
  if (words->empty()) {
    std::string list;
    for (const std::string& name : schema_names()) list += (list.empty() ? "" : "\n") + name;
    session.print_result(list, schema_names());
  } else {
    write_to_stdout(schema_text(words->front()));
  }
  return 0;
}

}  // namespace organbake
