// SPDX-License-Identifier: GPL-3.0-or-later
// Where results may go: no user's files are overwritten, two bakes of one bundle come one after the
// other, and a bundle appears whole, with its manifest.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "organbake/bundle/bundle.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/parallel.h"
#include "organbake/core/version.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/options_json.h"
#include "organbake/pipelines/runner.h"

namespace organbake {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::json;

void check_parent(const fs::path& target) {
  fs::path parent = fs::absolute(target).parent_path();
  while (!fs::exists(parent) && parent.has_relative_path()) parent = parent.parent_path();
  if (!fs::is_directory(parent)) {
    throw IoError::writing(target, parent.string() + " is a file, not a folder");
  }
  // What may be written is not what can be: one tries.
  std::string probe = (parent / ".organbake-XXXXXX").string();
  if (::mkdtemp(probe.data()) == nullptr) {
    throw IoError::writing(target,
                           "cannot be written: " + parent.string() + ": " + std::strerror(errno));
  }
  ::rmdir(probe.c_str());
}

void add_listed_files(const fs::path& document, const std::set<std::string>& schemas,
                      std::set<std::string>& listed) {
  if (!fs::is_regular_file(document)) return;
  const Json json = Json::parse(read_text_file(document), nullptr, false);
  if (!json.is_object() || !json.contains("schema") || !json["schema"].is_string()) return;
  if (!schemas.contains(json["schema"].get<std::string>())) return;
  listed.insert(document.filename().string());
  for (const Json& file : json.value("files", Json::array())) {
    const Json path = file.is_object() ? file.value("path", Json()) : file;
    if (path.is_string()) listed.insert(path.get<std::string>());
  }
}

}  // namespace

void check_output_file(const fs::path& file, const fs::path& ending) {
  if (file.has_extension() && file.extension() != ending) {
    throw UsageError(file.string() + ": the result is written as " + ending.string() +
                     "; give it that ending");
  }
  check_parent(file_to_write(file));
}

void check_output_folder(const fs::path& folder) {
  check_parent(folder.has_filename() ? folder : folder.parent_path());
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) throw IoError::writing(folder, "is a file; name a folder");
  std::set<std::string> ours;
  add_listed_files(folder / "manifest.json", {kBundleSchema, kSkinnedBundleSchema}, ours);
  add_listed_files(folder / "report.json", {"organbake/stage-report/1"}, ours);
  for (const fs::path& file : list_files(folder)) {
    if (ours.contains(file.generic_string())) continue;
    throw IoError::writing(folder, "holds " + file.generic_string() +
                                       ", which organbake did not write; choose another folder "
                                       "or move it away");
  }
}

void make_folder_of(const fs::path& file) {
  if (file.has_parent_path()) make_folder(file.parent_path());
}

void copy_into(const fs::path& from, const fs::path& to) {
  make_folder_of(to);
  // The library's own copying calls a disk that fills up on the way an input/output error.
  write_file_atomically(to, read_file(from));
}

namespace {

using Clock = std::chrono::steady_clock;

// Whoever held the lock before may have taken the file away: then the lock is of nothing.
bool is_still_there(int fd, const fs::path& file) {
  struct stat open {
  }, named{};
  return ::fstat(fd, &open) == 0 && ::stat(file.c_str(), &named) == 0 &&
         open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

}  // namespace

FileLock::FileLock(LockOptions options, const RunContext& context) : options_(std::move(options)) {
  constexpr std::chrono::milliseconds kPause{50};
  const Clock::time_point end = Clock::now() + options_.patience;
  bool told = false;
  while (!try_once()) {
    context.throw_if_cancelled();
    if (Clock::now() >= end) throw Error(ExitCode::try_again, options_.busy);
    if (!told) context.info("waits for another program that writes to the same place");
    told = true;
    std::this_thread::sleep_for(kPause);
  }
}

bool FileLock::try_once() {
  constexpr mode_t kMode = 0666;
  const int closing = options_.inherited ? 0 : O_CLOEXEC;
  const int fd = ::open(options_.file.c_str(), O_WRONLY | O_CREAT | closing, kMode);
  if (fd < 0 && !options_.inherited) return true;
  if (fd < 0)
    throw IoError::writing(options_.file, "cannot be made: " + std::string(std::strerror(errno)));
  const bool taken = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!taken && is_still_there(fd, options_.file)) {
    fd_ = fd;
    return true;
  }
  ::close(fd);
  return false;
}

FileLock::~FileLock() {
  if (fd_ < 0) return;
  if (!options_.inherited) ::unlink(options_.file.c_str());
  ::close(fd_);
}

LockOptions output_lock(const fs::path& target) {
  constexpr std::chrono::minutes kPatience{2};
  const fs::path absolute = fs::absolute(target).lexically_normal();
  const fs::path named = absolute.has_filename() ? absolute : absolute.parent_path();
  make_folder_of(named);
  return {.file = named.parent_path() / ("." + named.filename().string() + ".lock"),
          .patience = kPatience,
          .busy = target.string() +
                  " is busy: another program has been writing it for minutes; wait for it, or name "
                  "another -o"};
}

namespace {

std::string generator() { return std::string("organbake ") + kVersion; }
constexpr const char* kSurface = "surface.ply";

// The recipe as it was run, again a recipe: every option resolved, nothing of this machine in it.
Json recipe_echo(const BakeResult& bake) {
  BundleOptions bundle = bake.recipe.bundle;
  OptionList bundle_options;
  bind(bundle_options, bundle);
  Json echo = {{"schema", "organbake/recipe/1"},
               {"name", bake.recipe.name},
               {"bundle", to_json(bundle_options)}};
  if (!bake.recipe.quality.empty()) echo["quality"] = bake.recipe.quality;
  for (const Step& step : bake.plan.steps) echo[step.stage->name] = Json::parse(step.options_json);
  return echo;
}

std::string report_json(const BakeResult& bake) {
  Json stages = Json::array();
  for (const StepResult& step : bake.steps) {
    stages.push_back(Json::parse(step.entry.record.report_json));
  }
  const Json report = {{"schema", "organbake/bake-report/1"},
                       {"stages", stages},
                       {"left_out", left_out_json(bake.plan.left_out)}};
  return report.dump(2) + "\n";
}

// The inputs that the bake read, by role.
std::map<std::string, const InputSource*> given_inputs(const Plan& plan) {
  std::map<std::string, const InputSource*> given;
  for (const Step& step : plan.steps) {
    for (const InputSource& input : step.inputs) {
      if (!input.given.empty()) given[input.name] = &input;
    }
  }
  return given;
}

Manifest make_manifest(const BakeResult& bake, Runner& runner) {
  Manifest manifest;
  manifest.name = bake.recipe.name;
  manifest.generator = generator();
  manifest.recipe_json = recipe_echo(bake).dump();
  for (const auto& [role, input] : given_inputs(bake.plan)) {
    manifest.input_hashes.emplace_back(role, runner.sum_of_given(input->kind, input->given));
  }
  for (const Step& step : bake.plan.steps) {
    const Json options = Json::parse(step.options_json);
    if (options.contains("seed")) manifest.seeds.emplace_back(step.stage->name, options["seed"]);
  }
  return manifest;
}

// What the bundle depends on, as if its assembly were one more step of the plan.
StepIngredients ingredients_of(const BakeResult& bake, Runner& runner) {
  const Json options = {{"recipe", recipe_echo(bake)},
                        {"left_out", left_out_json(bake.plan.left_out)},
                        {"generator", generator()}};
  StepIngredients ingredients{"bundle", quick_hash_of_file("/proc/self/exe"), options.dump(), {}};
  for (const StepResult& step : bake.steps) {
    ingredients.inputs[step.step->stage->name] = step.entry.ingredients.key();
  }
  for (const auto& [role, input] : given_inputs(bake.plan)) {
    ingredients.inputs["given " + role] = runner.hash_of_given(input->kind, input->given);
  }
  return ingredients;
}

// Which of a step's files go into the bundle; capture colours the surface on its way.
std::vector<std::string> parts_of(const StepResult& step, const BundleOptions& options) {
  const std::string& stage = step.step->stage->name;
  const auto belongs = [&](const std::string& file) {
    if (stage == "capture") return file != kSurface || options.surface;
    if (stage == "place") return file == "cameras.json";
    return stage == "decimate" || stage == "mechanics";
  };
  std::vector<std::string> parts;
  for (const CachedFile& file : step.entry.files) {
    if (belongs(file.path)) parts.push_back(file.path);
  }
  return parts;
}

void copy_parts(const BakeResult& bake, Runner& runner, const fs::path& folder) {
  for (std::size_t i = 0; i < bake.steps.size(); ++i) {
    const std::vector<std::string> parts = parts_of(bake.steps[i], bake.recipe.bundle);
    if (parts.empty()) continue;
    runner.ensure_sound(bake.steps, i);
    for (const std::string& file : parts) {
      copy_into(bake.steps[i].entry.folder / file, folder / file);
    }
  }
}

// Every byte is read again: a bake onto a damaged bundle mends it.
bool is_whole(const fs::path& target, const std::string& manifest_text) {
  try {
    if (!fs::exists(target / "manifest.json")) return false;
    if (read_text_file(target / "manifest.json") != manifest_text) return false;
    const BundleReader bundle(target);
    const auto& files = bundle.manifest().files;
    parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) { bundle.read(files[i].path); });
    return true;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

Json left_out_json(const std::vector<LeftOut>& left_out) {
  Json list = Json::array();
  for (const LeftOut& item : left_out) {
    list.push_back({{"what", item.what}, {"why", item.why}});
  }
  return list;
}

BundleWritten write_bundle(const BakeResult& bake, Runner& runner, const fs::path& target) {
  const StepIngredients ingredients = ingredients_of(bake, runner);
  const std::optional<CacheEntry> known = runner.cache().find(ingredients);
  if (known && is_whole(target, read_text_file(known->folder / "manifest.json"))) {
    AtomicFolder::sweep(target);
    return BundleWritten::unchanged;
  }
  check_output_folder(target);
  AtomicFolder folder(target);
  copy_parts(bake, runner, folder.path());
  write_file_atomically(folder.path() / "report.json", report_json(bake));
  write_manifest(folder.path(), make_manifest(bake, runner));
  runner.cache().store(ingredients, false, [&](const fs::path& entry) {
    copy_into(folder.path() / "manifest.json", entry / "manifest.json");
    return StepRecord{"{}"};
  });
  folder.commit();
  return BundleWritten::anew;
}

}  // namespace organbake
