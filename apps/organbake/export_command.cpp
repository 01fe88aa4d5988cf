// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/error.h"
#include "web_page.h"

namespace organbake {
namespace fs = std::filesystem;

int run_export(const Arguments& arguments, Session& session) {
  ExportOptions asked;
  fs::path output;
  OptionList options, own;
  bind(own, asked);
  options
      .add("output", &output, {.help = "the folder to write; of web: the page", .short_flag = "-o"})
      .append(own);
  const auto words = session.read_command(
      arguments, "export BUNDLE --format FORMAT -o OUTPUT",
      "Writes a bundle's surface, cameras and pictures for other programs.", options, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake export' needs a bundle");
  if (output.empty()) throw UsageError("-o is missing: where shall the export go?");
  write_export(words->front(), asked, output, session);
  session.print_result(output.string(), {{"output", output.string()}});
  return 0;
}

}  // namespace organbake
