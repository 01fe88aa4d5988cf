// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/files.h"
#include "organbake/commands.h"
#include "pipelines/options_json.h"
#include "pipelines/output_target.h"
#include "pipelines/stage_module.h"
#include "pipelines/stages/export/options.h"

namespace organbake {
namespace fs = std::filesystem;

int run_export(const Arguments& arguments, Session& session) {
  ExportOptions asked;
  fs::path output;
  OptionList options, own;
  bind(own, asked);
  options.add("output", &output, {.help = "the folder to write; of web: the page"}).append(own);
  const auto words = session.read_command(
      arguments, "export BUNDLE --format FORMAT -o OUTPUT",
      "Writes a bundle's surface, cameras and pictures for other programs.", options, 1);
  if (!words) return 0;
  if (words->empty()) throw UsageError("'organbake export' needs a bundle");
  if (output.empty()) throw UsageError("-o is missing: where shall the export go?");
  const bool is_page = asked.format == ExportFormat::web;
  if (is_page) check_output_file(output, ".html");
  if (!is_page) check_output_folder(output);
  const fs::path bundle = words->front();
  if (!fs::exists(bundle)) throw NoInputError(bundle, "there is no such file or folder");
  // The formats' libraries are heavy, so a module writes them.
  AtomicFolder folder(output);
  const Stage stage{.name = "export"};
  const RunContext context = session.context(stage.name);
  run_in_module(stage, {to_json(own).dump(), {{"bundle", bundle}}, folder.path(), context});
  if (is_page) fs::rename(folder.path() / kWebPageFile, file_to_write(output));
  if (!is_page) folder.commit();
  session.print_result(output.string(), {{"output", output.string()}});
  return 0;
}

}  // namespace organbake
