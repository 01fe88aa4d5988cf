// SPDX-License-Identifier: GPL-3.0-or-later
#include "web_page.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/output_target.h"
#include "organbake/pipelines/outputs.h"
#include "organbake/pipelines/stage_module.h"

namespace organbake {
namespace fs = std::filesystem;

void write_export(const fs::path& bundle, const ExportOptions& options, const fs::path& output,
                  Session& session) {
  const bool is_page = options.format == ExportFormat::web;
  is_page ? check_output_file(output, ".html") : check_output_folder(output);
  if (!fs::exists(bundle)) throw NoInputError(bundle, "there is no such file or folder");
  AtomicFolder folder(output);
  const Stage stage{.name = "export"};
  const RunContext context = session.context(stage.name);
  context.progress(0);
  const StageReport report =
      run_in_module(stage, {&options, {}, {{"bundle", bundle}}, folder.path(), context});
  context.progress(1);
  if (is_page) return write_file_atomically(output, read_file(folder.path() / kWebPageFile));
  std::vector<std::string> files;
  for (const fs::path& file : list_files(folder.path())) files.push_back(file.generic_string());
  write_file_atomically(folder.path() / "report.json",
                        folder_report(stage_report_json(stage, report), files));
  folder.commit();
}

void write_player_page(const fs::path& bundle, const fs::path& page, Session& session) {
  ExportOptions options;
  options.format = ExportFormat::web;
  write_export(bundle, options, page, session);
}

}  // namespace organbake
