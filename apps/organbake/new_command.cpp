// SPDX-License-Identifier: GPL-3.0-or-later
// From a folder of somebody's own data to what bakes it: a recipe for one organ or clip, a table
// for several. Which volumes are masks, and what their labels are called, `inspect` tells.
#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/pipelines/batch_run.h"
#include "organbake/pipelines/export_options.h"
#include "organbake/pipelines/recipe.h"
#include "organbake/pipelines/runner.h"
#include "organbake/pipelines/stage.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// What one bake takes.
struct PatientCase {
  std::string name, input;  // "ct", "frames" or "surface"
  fs::path path, mask;
  std::vector<std::string> labels;  // of the mask, a line each: "5 liver: 1423.1 ml, …"
  std::vector<std::string> doubts;  // what its surface's stage warns of
  std::vector<std::string> series;  // of a folder that holds several
};

// What `inspect` lists under a name.
std::vector<std::string> listed(const StageReport& report, const std::string& figure) {
  for (const auto& [name, value] : report.figures)
    if (name == figure) return std::get<std::vector<std::string>>(value);
  return {};
}

// Nothing of a file that is damaged.
std::optional<StageReport> look_at(const fs::path& volume, Session& session) {
  try {
    return inspect(volume, inspect_options(), session);
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_data && error.code() != ExitCode::no_input) throw;
    session.terminal().log(LogLevel::warning,
                           volume.string() + ": passed over, it cannot be read: " + error.what());
    return std::nullopt;
  }
}

std::string stem_of(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.substr(0, name.find('.'));
}

// A mask belongs to the first scan that has none yet, of its own folder or the one above. Whether
// there is such a scan.
bool take_mask(const fs::path& mask, std::vector<std::string> labels,
               std::vector<PatientCase>& cases) {
  for (PatientCase& one : cases) {
    const fs::path folder = one.path.parent_path();
    const bool near = mask.parent_path() == folder || mask.parent_path().parent_path() == folder;
    if (one.input != "ct" || !one.mask.empty() || !near) continue;
    one.mask = mask;
    one.labels = std::move(labels);
    return true;
  }
  return false;
}

std::vector<PatientCase> cases_of(const std::vector<FoundInput>& found, Session& session) {
  std::vector<PatientCase> cases;
  std::vector<std::pair<fs::path, std::vector<std::string>>> masks;
  for (const FoundInput& one : found) {
    std::vector<std::string> labels, series;
    if (one.input == "ct") {
      const std::optional<StageReport> report = look_at(one.path, session);
      if (!report) continue;
      labels = listed(*report, "labels");
      series = listed(*report, "series");
    }
    if (labels.empty()) {
      if (series.size() < 2) series.clear();
      cases.push_back({stem_of(one.path), one.input, fs::absolute(one.path), {}, {}, {}, series});
    } else {
      masks.emplace_back(fs::absolute(one.path), std::move(labels));
    }
  }
  for (auto& [mask, labels] : masks)
    if (!take_mask(mask, std::move(labels), cases))
      session.terminal().log(LogLevel::info, mask.string() +
                                                 ": passed over, it is a mask and no scan without "
                                                 "one lies beside it");
  return cases;
}

// The line of a liver where there is one, else what comes first. Nothing without labels.
std::string line_to_take(const PatientCase& one) {
  if (one.labels.empty()) return "";
  const auto liver = std::find_if(one.labels.begin(), one.labels.end(), [](const auto& line) {
    return line.find(" liver:") != std::string::npos;
  });
  return liver == one.labels.end() ? one.labels.front() : *liver;
}

std::string label_to_take(const PatientCase& one) {
  const std::string line = line_to_take(one);
  return line.substr(0, line.find_first_of(" :"));
}

std::vector<std::string> material_names() {
  return find_stage("capture")->make_options().list.find("material")->traits.choices;
}

// The material that the label's name holds ("kidney_left"), or its mask's file where the label has
// none, or plain for another organ; a liver's without a mask.
std::string material_of(const PatientCase& one) {
  if (one.mask.empty()) return "liver";
  const std::string line = line_to_take(one);
  std::string name = line.substr(0, line.find(':'));
  if (name.find(' ') == std::string::npos) name = one.mask.filename().string();
  constexpr std::pair<const char*, const char*> kOthers[] = {
      {"colon", "bowel"}, {"duodenum", "bowel"}, {"intestine", "bowel"}};
  std::string plain_name;
  for (const unsigned char c : name)
    if (std::isalpha(c)) plain_name += static_cast<char>(std::tolower(c));
  for (const std::string& material : material_names())
    if (plain_name.find(material) != std::string::npos) return material;
  for (const auto& [part, material] : kOthers)
    if (plain_name.find(part) != std::string::npos) return material;
  return "plain";
}

// Takes the organ's surface as the recipe would, for what that warns of: a mask in the wrong place,
// an organ that is cut. `beside`: where there is room for the surface.
std::vector<std::string> doubts_of(const PatientCase& one, const fs::path& beside,
                                   Session& session) {
  std::vector<std::string> doubts;
  const Stage& stage = *find_stage("isosurface");
  const StageOptions options = stage.make_options();
  for (const auto& [name, value] :
       {std::pair<std::string, std::string>{"cap", "round"}, {"label", label_to_take(one)}}) {
    const Option& option = *options.list.find(name);
    option.set(parse_option(option, value, name));
  }
  const AtomicFolder folder(beside);
  const RunContext context =
      session.context(stage.name).heard_by([&](LogLevel level, std::string_view text) {
        if (level == LogLevel::warning) doubts.emplace_back(text);
      });
  try {
    run_in_module(stage, {options.storage.get(),
                          {},
                          {{"ct", one.path}, {"mask", one.mask}},
                          folder.path(),
                          context});
  } catch (const Error& error) {
    if (error.code() != ExitCode::bad_data) throw;
    context.warn(std::string("as it stands it cannot be baked: ") + error.what());
  }
  return doubts;
}

const char* recipe_for(const PatientCase& one) {
  return one.input == "frames" ? "laparoscopy" : "liver";
}

std::string yaml_text(const std::string& text) { return nlohmann::json(text).dump(); }

std::string inputs_text(const PatientCase& one) {
  std::string text = "inputs:\n  " + one.input + ": " + yaml_text(one.path.string()) + "\n";
  if (!one.mask.empty()) {
    text += "  mask: " + yaml_text(one.mask.string()) + "\n  label: " + label_to_take(one) +
            "  # the organ's; the mask has these:\n";
    for (const std::string& line : one.labels) text += "  #   " + line + "\n";
    if (!one.doubts.empty()) text += "  # Of this label's surface organbake says:\n";
    for (const std::string& doubt : one.doubts) text += "  #   " + doubt + "\n";
  }
  if (!one.series.empty()) {
    text += "  # It holds several series; say which by isosurface.series, below:\n";
    for (const std::string& line : one.series) text += "  #   " + line + "\n";
  }
  if (one.input == "ct" && one.mask.empty())
    text +=
        "  # Without a mask, everything over isosurface.iso becomes the surface. Give a mask and\n"
        "  # the organ's label in it to take an organ:\n"
        "  # mask: \"labels.nii.gz\"\n  # label: 5\n";
  if (one.input == "frames")
    text +=
        "  # The scope's lens, if you know it (cameras.json of one camera):\n"
        "  # intrinsics: \"cameras.json\"\n";
  return text;
}

// The known recipe's sections as they are, comments with them, behind the case's own inputs.
std::string recipe_text(const PatientCase& one, const fs::path& file) {
  std::string known = read_text_file(recipe_file(recipe_for(one)));
  constexpr std::string_view kLiverLook = "{material: liver}";
  const std::string material = material_of(one);
  if (const std::size_t look = known.find(kLiverLook); look != std::string::npos)
    known.replace(look, kLiverLook.size(),
                  "{material: " + material +
                      (material == "plain" ? "}  # of this organ none is known; 'organbake "
                                             "materials' lists them"
                                           : "}"));
  const std::size_t name = known.find("\nname: ");
  const std::string bundle = shell_word(file.stem().string() + "_bundle");
  return "# Made by 'organbake new'. Look through it, then bake and play:\n#   organbake bake " +
         shell_word(file.string()) + " -o " + bundle + "\n#   organplay " + bundle + "\n" +
         "schema: organbake/recipe/1\nname: " + yaml_text(one.name) + "\n" + inputs_text(one) +
         known.substr(known.find('\n', name + 1) + 1);
}

std::string table_text(const std::vector<PatientCase>& cases) {
  std::vector<BatchCase> rows;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const PatientCase& one = cases[i];
    const bool twice = std::count_if(cases.begin(), cases.end(), [&](const PatientCase& other) {
                         return other.name == one.name;
                       }) > 1;
    const std::string name =
        twice || !flaw_of_case_name(one.name).empty() ? "case" + std::to_string(i + 1) : one.name;
    rows.push_back({name, {one.input + "=" + one.path.string()}});
    if (one.mask.empty()) continue;
    rows.back().settings.push_back("mask=" + one.mask.string());
    rows.back().settings.push_back("label=" + label_to_take(one));
    rows.back().settings.push_back("capture.material=" + material_of(one));
  }
  return case_table_text(rows);
}

// All that one recipe bakes: scans before clips, clips before surfaces.
std::vector<PatientCase> of_one_kind(const std::vector<PatientCase>& cases, Session& session) {
  for (const char* input : {"ct", "frames", "surface"}) {
    std::vector<PatientCase> kind, rest;
    for (const PatientCase& one : cases) (one.input == input ? kind : rest).push_back(one);
    if (kind.empty()) continue;
    for (const PatientCase& one : rest)
      session.terminal().log(LogLevel::info, one.path.string() + ": passed over, " + input +
                                                 " goes first; name it alone to bake it");
    return kind;
  }
  throw UsageError("no scan, clip or surface is there that can be read");
}

}  // namespace

int run_new(const Arguments& arguments, Session& session) {
  fs::path output;
  OptionList options;
  options.add(
      "output", &output,
      {.help = "the recipe (.yaml) or table (.csv) to write; else PATIENT.yaml or .csv here",
       .short_flag = "-o"});
  const auto words = session.read_command(
      arguments, "new PATIENT [-o FILE]",
      "Looks at a folder of scans, clips or surfaces and writes what bakes it: a recipe with "
      "comments, or for several scans or clips a table for 'organbake batch'.",
      options, 1, "a folder of scans or clips");
  if (!words) return 0;
  const fs::path patient = fs::absolute(words->front()).lexically_normal();
  std::vector<PatientCase> cases = of_one_kind(cases_of(inputs_in(patient), session), session);
  const bool single = cases.size() == 1;
  const fs::path named = patient.has_filename() ? patient : patient.parent_path();
  if (single) cases.front().name = stem_of(named);
  if (output.empty()) output = stem_of(named) + (single ? ".yaml" : ".csv");
  check_output_file(output, single ? ".yaml" : ".csv");
  if (fs::exists(output))
    throw IoError::writing(output, "is there already; name another -o, or remove it");
  if (single && !cases.front().mask.empty())
    cases.front().doubts = doubts_of(cases.front(), output, session);
  write_file_atomically(output, single ? recipe_text(cases.front(), output) : table_text(cases));
  const std::string next = single ? "organbake bake " + shell_word(output.string()) + " -o " +
                                        shell_word(output.stem().string() + "_bundle")
                                  : "organbake batch " + shell_word(output.string()) +
                                        " --recipe " + recipe_for(cases.front()) + " -o " +
                                        shell_word(output.stem().string() + "_organs");
  session.terminal().log(LogLevel::info, "next: " + next);
  session.print_result(output.string(),
                       {{"output", output.string()}, {"cases", cases.size()}, {"next", next}});
  return 0;
}

namespace {

void list_recipes(Session& session) {
  std::string text;
  nlohmann::json json = nlohmann::json::array();
  for (const KnownRecipe& recipe : known_recipes()) {
    constexpr std::size_t kColumn = 16;
    text += recipe.name + std::string(kColumn - std::min(kColumn - 1, recipe.name.size()), ' ') +
            recipe.summary + "\n";
    json.push_back(
        {{"name", recipe.name}, {"summary", recipe.summary}, {"file", recipe.file.string()}});
  }
  session.print_result(text + "\nOne as it is written: organbake recipes liver > mine.yaml\n" +
                           "Baked: organbake bake liver --set ct=CT -o BUNDLE",
                       json);
}

}  // namespace

int run_recipes(const Arguments& arguments, Session& session) {
  const auto words = session.read_command(arguments, "recipes [RECIPE]",
                                          "Lists the recipes that come with organbake, which bake, "
                                          "batch and plan take by name from any "
                                          "folder, or prints one of them, to be changed.",
                                          {}, 1);
  if (!words) return 0;
  if (words->empty()) {
    list_recipes(session);
  } else {
    write_to_stdout(read_text_file(recipe_file(words->front())));
  }
  return 0;
}

namespace {

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

int run_materials(const Arguments& arguments, Session& session) {
  fs::path output;
  SwatchOptions sheet;
  OptionList options;
  options
      .add("output", &output,
           {.help = "a picture of all, a ball of 120 mm each, in the order of the list",
            .value = "FILE",
            .short_flag = "-o"})
      .add("columns", &sheet.columns, {.help = "of the picture", .range = {1, 32}})
      .add("side_px", &sheet.side_px, {.help = "of one ball's picture", .range = {32, 2048}});
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
