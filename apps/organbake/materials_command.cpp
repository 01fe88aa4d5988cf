// SPDX-License-Identifier: GPL-3.0-or-later
#include <nlohmann/json.hpp>

#include "commands.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/output_target.h"
#include "organbake/pipelines/stage_module.h"
#include "organbake/pipelines/swatch_options.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Rows of the sheet, read as a page: names in the order of its swatches.
std::string listed(const std::vector<std::string>& names, int columns) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += names[i] + (i + 1 == names.size() ? "" : (int(i) + 1) % columns == 0 ? "\n" : ", ");
  return text;
}

void draw_sheet(const SwatchOptions& options, const fs::path& output, Session& session) {
  check_output_file(output, ".png");
  const AtomicFolder folder(output);
  const RunContext context = session.context("materials");
  context.progress(0);
  run_in_module(Stage{.name = "swatches"}, {&options, {}, {}, folder.path(), context});
  write_file_atomically(output, read_file(folder.path() / kSwatchFile));
}

}  // namespace

std::vector<std::string> material_names() {
  return find_stage("capture")->make_options().list.find("material")->traits.choices;
}

int run_materials(const Arguments& arguments, Session& session) {
  fs::path output;
  SwatchOptions sheet;
  OptionList options;
  options
      .add("output", &output,
           {.help = "a picture of all, a ball of 120 mm each, in the order of the list",
            .value = "FILE",
            .short_flag = "-o"})
      .add("columns", &sheet.columns, {.help = "of the picture", .min = 1, .max = 32})
      .add("side_px", &sheet.side_px,
           {.help = "of one ball's picture", .unit = "px", .min = 32, .max = 2048});
  const auto words = session.read_command(
      arguments, "materials [-o SHEET.png]",
      "Lists the materials that a surface without colours can get: --set capture.material=NAME. "
      "The picture shows their colours in the light that they are baked in, a row of the list each "
      "row.",
      options, 0);
  if (!words) return 0;
  const std::vector<std::string> names = material_names();
  if (!output.empty()) draw_sheet(sheet, output, session);
  session.print_result(listed(names, sheet.columns),
                       {{"materials", names}, {"output", output.string()}});
  return 0;
}

}  // namespace organbake
