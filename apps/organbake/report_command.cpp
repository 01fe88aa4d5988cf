// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/bundle_page.h"
#include "organbake/pipelines/output_target.h"

namespace organbake {

int run_report(const Arguments& arguments, Session& session) {
  std::filesystem::path output;
  OptionList options;
  options.add("output", &output,
              {.help = "the page; else BUNDLE_report.html beside the bundle",
               .value = "FILE",
               .short_flag = "-o"});
  const auto words = session.read_command(
      arguments, "report BUNDLE [-o PAGE.html]",
      "Writes one page about a bundle: warnings, pictures, errors, and what was skipped and why.",
      options, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake report' needs a bundle");
  const BundleReader reader(words->front());
  const std::filesystem::path beside = page_beside(words->front());
  if (output.empty()) output = beside;
  check_output_file(output, ".html");
  const bool has_player = std::filesystem::exists(player_page_beside(words->front()));
  const std::string player = has_player ? player_link(words->front(), output) : "";
  write_file_atomically(output, bundle_page(reader, run_of_page(beside, reader), player));
  session.print_result(output.string(), {{"output", output.string()}});
  return 0;
}

}  // namespace organbake
