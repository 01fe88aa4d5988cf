// SPDX-License-Identifier: GPL-3.0-or-later

#include <unistd.h>
#include <atomic>
#include <thread>

#include "fake_stages.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/pipelines/cache.h"
#include "organbake/pipelines/runner.h"
#include "support/error_message.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

class OutputTarget : public testing::Test {
 protected:
  fs::path path() const { return folder_.path(); }
  void expect_refused(const fs::path& folder) {
    message_of(ExitCode::cannot_write, [&] { check_output_folder(folder); });
  }
  TemporaryFolder folder_;
};

TEST_F(OutputTarget, NewAndEmptyFoldersAreFine) {
  EXPECT_NO_THROW(check_output_folder(path() / "new"));
  EXPECT_NO_THROW(check_output_folder(path() / "deep" / "new" / ""));
  fs::create_directory(path() / "empty");
  EXPECT_NO_THROW(check_output_folder(path() / "empty"));
  EXPECT_NO_THROW(check_output_folder("relative"));
  EXPECT_FALSE(fs::exists(path() / "deep")) << "checking makes nothing";
}

TEST_F(OutputTarget, AUsersFolderIsRefused) {
  write_file_atomically(path() / "thesis.tex", "years of work");
  expect_refused(path());
  write_file_atomically(path() / "manifest.json", R"({"name": "some web app"})");
  expect_refused(path());
}

TEST_F(OutputTarget, OurFoldersMayBeReplacedButNotWhatLiesBesideOurFiles) {
  fs::create_directory(path() / "a");
  write_file_atomically(path() / "a" / "b.exr", "x");
  for (const std::string version : {"1", "2"}) {
    write_file_atomically(path() / "manifest.json", R"({"schema": "organbake/bundle/)" + version +
                                                        R"(", "files": [{"path": "a/b.exr"}]})");
    EXPECT_NO_THROW(check_output_folder(path())) << version;
  }
  write_file_atomically(path() / "notes.txt", "mine");
  expect_refused(path());
}

TEST_F(OutputTarget, StageFoldersAreKnownByTheirReport) {
  write_file_atomically(path() / "report.json",
                        R"({"schema": "organbake/stage-report/1", "files": ["vpm.ply"]})");
  write_file_atomically(path() / "vpm.ply", "x");
  EXPECT_NO_THROW(check_output_folder(path()));
}

TEST_F(OutputTarget, FilesAndFoldersAreNotMixedUp) {
  write_file_atomically(path() / "file", "x");
  expect_refused(path() / "file");
  expect_refused(path() / "file" / "below");
  EXPECT_THROW(check_output_file(path(), ".ply"), IoError);
  EXPECT_NO_THROW(check_output_file(path() / "file", ".ply"));
  EXPECT_NO_THROW(check_output_file(path() / "x.ply", ".ply"));
  EXPECT_THROW(check_output_file(path() / "x.stl", ".ply"), UsageError);
}

TEST_F(OutputTarget, AnUnwritableFolderIsRefused) {
  expect_refused("/proc/organ");  // what root may write, and nobody can
  if (::geteuid() == 0) return;
  fs::create_directory(path() / "locked");
  fs::permissions(path() / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  expect_refused(path() / "locked" / "out");
}

class OutputLock : public testing::Test {
 protected:
  LockOptions options(int patience_ms) const {
    LockOptions lock = output_lock(folder_.path() / "deep" / "organ");
    lock.patience = std::chrono::milliseconds(patience_ms);
    return lock;
  }
  TemporaryFolder folder_;
};

TEST_F(OutputLock, LeavesNothingBehind) {
  { const FileLock lock(options(0)); }
  EXPECT_TRUE(list_files(folder_.path()).empty());
}

TEST_F(OutputLock, OfTwoTheSecondWaitsOrSaysBusy) {
  std::optional<FileLock> first(std::in_place, options(0));
  const std::string told =
      message_of(ExitCode::try_again, [&] { const FileLock second(options(1)); });
  EXPECT_NE(told.find("is busy"), std::string::npos);
  std::atomic<bool> held = true;
  std::thread waiting([&] {
    const FileLock second(options(60'000));
    EXPECT_FALSE(held) << "it came before the first was done";
  });
  held = false;
  first.reset();
  waiting.join();
  EXPECT_TRUE(list_files(folder_.path()).empty());
}

// Each adds one to what it read; without the lock some additions are lost.
TEST_F(OutputLock, ManyComeOneAfterTheOther) {
  int sum = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&] {
      const FileLock lock(options(60'000));
      const int read = sum;
      std::this_thread::yield();
      sum = read + 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(sum, 8);
}

TEST_F(OutputLock, WhereItsFileCannotBeMadeAllGoOn) {
  LockOptions lock = options(0);
  lock.file = folder_.path() / "no" / "such" / "folder" / ".organ.lock";
  EXPECT_NO_THROW(FileLock{lock});
  lock.inherited = true;  // a batch's stays, so it must be there
  EXPECT_THROW(FileLock{lock}, Error);
}

TEST_F(OutputLock, ASlashAtTheEndNamesTheSamePlace) {
  EXPECT_EQ(output_lock(folder_.path() / "organ").file,
            output_lock(folder_.path() / "organ/").file);
}

using testing::HasSubstr;

constexpr const char* kWholeChain = "phantom isosurface decimate mechanics place capture";

class RunnerTest : public testing::Test {
 protected:
  struct Baked {
    std::string calls;
    BundleWritten written;
  };
  Baked bake(const std::vector<std::string>& settings = {}, const RunOptions& options = {}) {
    const Recipe asked = recipe("phantom: {seed: 7}\n", settings);
    const Plan plan = plan_bake(asked);
    Runner runner = stages_.runner(cache());
    std::vector<StepResult> steps = runner.run(plan, options);
    const BundleWritten written = write_bundle({asked, plan, steps}, runner, bundle());
    return {stages_.take_calls(), written};
  }
  std::map<std::string, std::string> bundle_files() const {
    std::map<std::string, std::string> files;
    for (const auto& file : list_files(bundle())) {
      files[file.string()] = read_text_file(bundle() / file);
    }
    return files;
  }
  Recipe recipe(const std::string& more = "phantom: {seed: 7}\n",
                const std::vector<std::string>& settings = {}) const {
    return recipe_from(folder_.path(), "schema: organbake/recipe/1\nname: test\n" + more, settings);
  }
  fs::path cache() const { return folder_.path() / "cache"; }
  fs::path bundle() const { return folder_.path() / "bundle"; }

  TemporaryFolder folder_;
  FakeStages stages_;
};

TEST_F(RunnerTest, AWarmBakeRunsNothingAndLeavesTheBundleAlone) {
  const Baked cold = bake();
  EXPECT_EQ(cold.calls, kWholeChain);
  EXPECT_EQ(cold.written, BundleWritten::anew);
  const auto time = fs::last_write_time(bundle() / "manifest.json");
  const Baked warm = bake();
  EXPECT_EQ(warm.calls, "");
  EXPECT_EQ(warm.written, BundleWritten::unchanged);
  EXPECT_EQ(fs::last_write_time(bundle() / "manifest.json"), time);
}

TEST_F(RunnerTest, OnlyWhatDependsOnAChangeRunsAgain) {
  bake();
  EXPECT_EQ(bake({"decimate.faces=100"}).calls, "decimate mechanics capture");
  EXPECT_EQ(bake({"mechanics.density_kg_per_m3=1000"}).calls, "mechanics");
  EXPECT_EQ(bake({"place.count=4"}).calls, "place capture");
  EXPECT_EQ(bake({"capture.base_step_mm=3"}).calls, "capture");
  EXPECT_EQ(bake({"bundle.surface=true"}).calls, "");
  EXPECT_EQ(bake().calls, "") << "and the first bake's steps are all still there";
}

TEST_F(RunnerTest, StepsMadeAnewWithTheSameContentStopTheChain) {
  bake();
  // The fake phantom's CT holds its options, so another seed changes everything below it; the
  // isosurface's label changes the surface too. A given file of equal content changes nothing.
  const std::string ct = (folder_.path() / "copy.mha").string();
  for (const auto& file : list_files(cache())) {
    if (file.filename() == "ct.mha") fs::copy_file(cache() / file, ct);
  }
  EXPECT_EQ(bake({"ct=" + ct}).calls, "capture") << "without the phantom there are no photos";
}

TEST_F(RunnerTest, ForceRunsAgainWithTheSameResult) {
  bake();
  const auto before = bundle_files();
  EXPECT_EQ(bake({}, {.force = true}).calls, kWholeChain);
  EXPECT_EQ(bundle_files(), before);
}

TEST_F(RunnerTest, AForecastTellsWhatWillRun) {
  Runner runner = stages_.runner(cache());
  for (const Forecast& forecast : runner.forecast(plan_bake(recipe()), {})) {
    EXPECT_FALSE(forecast.cached);
  }
  EXPECT_EQ(stages_.take_calls(), "");
  bake();
  const Plan plan = plan_bake(recipe("phantom: {seed: 7}\ndecimate: {faces: 9}\n"));
  const auto forecasts = runner.forecast(plan, {.explain = true});
  EXPECT_TRUE(forecasts[0].cached);
  EXPECT_EQ(forecasts[2].why, "faces was 80, is 9");
  EXPECT_EQ(forecasts[3].why, "its proxy is made anew");
  EXPECT_TRUE(forecasts[4].cached);
  EXPECT_THAT(explanation(forecasts[2]).front(), HasSubstr("decimate: to run, because faces was"));
}

TEST_F(RunnerTest, WarningsAreOneListWhetherAStageRanOrWasCached) {
  stages_.warning_stage = "place";
  const Plan plan = plan_bake(recipe());
  Runner runner = stages_.runner(cache());
  const std::vector<std::string> all = {"place: something is odd", "place: not good enough"};
  EXPECT_EQ(warnings_of(runner.run(plan, {})), all);
  EXPECT_EQ(stages_.heard, all) << "said once, while it ran or right after";
  stages_.heard.clear();
  EXPECT_EQ(warnings_of(runner.run(plan, {})), all);
  EXPECT_EQ(stages_.heard, all) << "and again when it is cached";
}

TEST_F(RunnerTest, WhatIsOddAboutAUsersFileIsSaidOnceAndTheCacheIsNotNamed) {
  const std::string given = (folder_.path() / "organ.obj").string();
  write_file_atomically(given, "a mesh");
  const Plan plan = plan_bake(recipe("", {"surface=" + given}));
  const auto warnings = [&](const std::string& odd_input) {
    stages_.odd_input = odd_input;
    Runner runner = stages_.runner(cache());
    const auto ran = warnings_of(runner.run(plan, {.force = true}));
    EXPECT_EQ(warnings_of(runner.run(plan, {})), ran) << "cached";
    return ran;
  };
  EXPECT_THAT(warnings("surface"), testing::ElementsAre("decimate: " + given + ": is odd"));
  EXPECT_THAT(warnings("proxy"), testing::Contains("mechanics: proxy.ply: is odd"));
}

TEST_F(RunnerTest, ABakeTellsOptionsAsItTakesThem) {
  stages_.warning_stage = "place";
  stages_.oddity = "too few; --count 9 is better";
  Runner runner = stages_.runner(cache());
  EXPECT_EQ(warnings_of(runner.run(plan_bake(recipe()), {})).front(),
            "place: too few; --set place.count=9 is better");
  EXPECT_EQ(stages_.heard.front(), "place: too few; --set place.count=9 is better");
  const Stage& place = *find_stage("place");
  const fs::path surface = folder_.path() / "s.ply";
  write_file_atomically(surface, "a mesh");
  const Plan alone = plan_stage(place, place.make_options(), {{"surface", surface}});
  EXPECT_EQ(warnings_of(runner.run(alone, {})).front(), "place: too few; --count 9 is better");
}

TEST_F(RunnerTest, ADamagedCacheIsMendedBeforeItsFilesAreUsed) {
  bake();
  const auto before = bundle_files();
  for (const auto& file : list_files(cache())) {
    if (file.filename() != "surface.ply" && file.filename() != "proxy.ply") continue;
    std::string text = read_text_file(cache() / file);
    text[0] ^= 1;
    std::ofstream(cache() / file, std::ios::trunc) << text;
  }
  fs::remove_all(bundle());
  EXPECT_EQ(bake().calls, "isosurface decimate capture");
  EXPECT_EQ(bundle_files(), before);
}

TEST_F(RunnerTest, ABakeOntoADamagedBundleMendsIt) {
  bake();
  const auto before = bundle_files();
  std::ofstream(bundle() / "proxy.ply", std::ios::app) << "x";
  EXPECT_EQ(bake().written, BundleWritten::anew);
  EXPECT_EQ(bundle_files(), before);
}

TEST_F(RunnerTest, AFailedStageLeavesNoBundleAndTheEarlierStepsCached) {
  stages_.failing_stage = "place";
  EXPECT_THROW(bake(), BadDataError);
  EXPECT_FALSE(fs::exists(bundle()));
  stages_.take_calls();
  stages_.failing_stage.clear();
  EXPECT_EQ(bake().calls, "place capture");
}

TEST_F(RunnerTest, TheBundleTellsEverythingButPathsAndTimes) {
  bake({"bundle.surface=true"});
  const BundleReader reader(bundle());
  EXPECT_EQ(reader.manifest().name, "test");
  EXPECT_EQ(reader.manifest().seeds.at(0), (std::pair<std::string, std::uint64_t>{"phantom", 7}));
  for (const char* file : {"proxy.ply", "cameras.json", "mechanics.json", "cam_000/depth.exr",
                           "surface.ply", "report.json"}) {
    EXPECT_TRUE(reader.has(file)) << file;
  }
  EXPECT_FALSE(reader.has("vpm.ply"));
  EXPECT_EQ(read_text_file(bundle() / "surface.ply"), "colours") << "the one with colours";
  const std::string all =
      read_text_file(bundle() / "manifest.json") + read_text_file(bundle() / "report.json");
  EXPECT_EQ(all.find(folder_.path().string()), std::string::npos);
  EXPECT_EQ(all.find("seconds"), std::string::npos);
  const auto report = nlohmann::json::parse(read_text_file(bundle() / "report.json"));
  EXPECT_EQ(report["stages"].size(), 6u);
  EXPECT_EQ(report["stages"][0]["skipped"][0]["why"], "a test");
}

TEST_F(RunnerTest, TheRecipeEchoIsARecipeThatBakesTheSame) {
  bake({"decimate.faces=33"});
  const auto before = bundle_files();
  const BundleReader reader(bundle());
  const Recipe echo = recipe_from(folder_.path(), reader.manifest().recipe_json);
  const Plan plan = plan_bake(echo);
  Runner runner = stages_.runner(cache());
  std::vector<StepResult> steps = runner.run(plan, {});
  EXPECT_EQ(stages_.take_calls(), "");
}

TEST_F(RunnerTest, SingleStagesWriteTheBytesOfTheBake) {
  bake();
  Runner runner = stages_.runner(folder_.path() / "other-cache");
  const auto run_stage = [&](const char* name, const std::vector<std::string>& choices,
                             const std::map<std::string, fs::path>& inputs, const fs::path& to) {
    const Stage& stage = *find_stage(name);
    const StageOptions options = stage.make_options();
    for (const std::string& seed : choices) {
      const Option& option = *options.list.find("seed");
      option.set(parse_option(option, seed, "seed"));
    }
    write_stage_outputs(runner.run(plan_stage(stage, options, inputs), {}).front(), to);
  };
  const fs::path out = folder_.path() / "steps";
  run_stage("phantom", {"7"}, {}, out / "phantom");
  run_stage("isosurface", {}, {{"ct", out / "phantom/ct.mha"}}, out / "surface.ply");
  run_stage("decimate", {}, {{"surface", out / "surface.ply"}}, out / "proxy.ply");
  run_stage("place", {}, {{"surface", out / "surface.ply"}}, out / "place");
  EXPECT_EQ(read_text_file(out / "proxy.ply"), read_text_file(bundle() / "proxy.ply"));
  EXPECT_EQ(read_text_file(out / "place/cameras.json"), read_text_file(bundle() / "cameras.json"));
  const auto report = nlohmann::json::parse(read_text_file(out / "place/report.json"));
  EXPECT_EQ(report["files"], nlohmann::json({"cameras.json", "vpm.ply"}));
}

}  // namespace
}  // namespace organbake
