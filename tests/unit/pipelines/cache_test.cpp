// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/pipelines/cache.h"

#include <thread>

#include "organbake/bundle/cameras_json.h"
#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "support/testing.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

StepIngredients some_step() { return {"decimate", "abc", R"({"faces":80})", {{"surface", "abc"}}}; }

class CacheTest : public testing::Test {
 protected:
  CacheEntry store(const StepIngredients& step, const std::string& content = "proxy",
                   bool replace = false) {
    return cache_.store(step, replace, [&](const fs::path& folder) {
      fs::create_directory(folder / "sub");
      write_file_atomically(folder / "a.ply", content);
      write_file_atomically(folder / "sub" / "b.txt", "beside " + content);
      return StepRecord{R"({"figures":{}})", 1.5, {"a <b>"}};
    });
  }

  TemporaryFolder folder_;
  Cache cache_{folder_.path() / "cache"};
};

TEST(StepKey, DependsOnEveryIngredient) {
  const std::string key = some_step().key();
  EXPECT_EQ(key.size(), 32u);
  EXPECT_EQ(key, some_step().key());
  const std::function<void(StepIngredients&)> changes[] = {
      [](auto& s) { s.stage = "place"; }, [](auto& s) { s.program = "abd"; },
      [](auto& s) { s.options_json = R"({"faces":81})"; },
      [](auto& s) { s.inputs["surface"] = "abd"; }, [](auto& s) { s.inputs["more"] = "x"; }};
  for (const auto& change : changes) {
    StepIngredients other = some_step();
    change(other);
    EXPECT_NE(other.key(), key);
  }
}

TEST_F(CacheTest, FindsWhatWasStored) {
  EXPECT_FALSE(cache_.find(some_step()));
  const CacheEntry stored = store(some_step());
  const auto found = cache_.find(some_step());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->folder, stored.folder);
  EXPECT_EQ(found->ingredients.key(), some_step().key());
  EXPECT_EQ(found->record.report_json, R"({"figures":{}})");
  EXPECT_EQ(found->record.seconds, 1.5);
  EXPECT_EQ(found->record.warnings, stored.record.warnings);
  ASSERT_EQ(found->files.size(), 2u);
  EXPECT_EQ(read_text_file(found->folder / found->files[0].path), "proxy");
  EXPECT_TRUE(found->sound());
}

TEST_F(CacheTest, ContentHashesAreThoseOfTheFilesThemselves) {
  const CacheEntry entry = store(some_step());
  EXPECT_EQ(entry.content_hash("a.ply"), quick_hash("proxy"));
  EXPECT_EQ(entry.content_hash("sub/b.txt"),
            quick_hash(quick_hash_of_file(entry.folder / "sub" / "b.txt") + "  b.txt\n"));
}

TEST_F(CacheTest, WhatAnotherModuleMadeDoesNotCount) {
  cache_.store(some_step(), false, [](const fs::path&) {
    return StepRecord{.report_json = "{}", .modules = {{"organbake_none.so", "abc"}}};
  });
  EXPECT_FALSE(cache_.find(some_step()));
}

TEST_F(CacheTest, DamageIsNoticed) {
  const CacheEntry entry = store(some_step());
  std::ofstream(entry.folder / "a.ply", std::ios::trunc) << "prexy";
  EXPECT_TRUE(cache_.find(some_step())) << "same size: told apart only by reading";
  EXPECT_FALSE(entry.sound());
  std::ofstream(entry.folder / "a.ply", std::ios::trunc) << "short";
  fs::resize_file(entry.folder / "a.ply", 3);
  EXPECT_FALSE(cache_.find(some_step()));
  store(some_step());
  EXPECT_TRUE(cache_.find(some_step()) && cache_.find(some_step())->sound()) << "and mended";
}

TEST_F(CacheTest, AnUnreadableEntryIsMadeAnew) {
  const CacheEntry entry = store(some_step());
  for (const char* text : {"", "{", "{}", R"({"schema": "organbake/step/1", "stage": 5})"}) {
    std::ofstream(entry.folder / "step.json", std::ios::trunc) << text;
    EXPECT_FALSE(cache_.find(some_step())) << text;
  }
  store(some_step());
  EXPECT_TRUE(cache_.find(some_step()));
}

TEST_F(CacheTest, AFailedStepLeavesNothing) {
  EXPECT_THROW(cache_.store(some_step(), false,
                            [](const fs::path& folder) -> StepRecord {
                              write_file_atomically(folder / "half", "x");
                              throw BadDataError("no");
                            }),
               BadDataError);
  EXPECT_TRUE(fs::is_empty(cache_.folder()));
}

TEST_F(CacheTest, ConcurrentBakesShareOneEntry) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([this] {
      for (int round = 0; round < 20; ++round) store(some_step());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(cache_.find(some_step())->sound());
  EXPECT_EQ(std::distance(fs::directory_iterator(cache_.folder()), {}), 1);
}

TEST_F(CacheTest, TheNearestEntryTellsWhatChanged) {
  EXPECT_FALSE(cache_.nearest(some_step()));
  store(some_step());
  StepIngredients far = some_step();
  far.options_json = R"({"faces":10})";
  far.inputs["surface"] = "zzz";
  store(far);
  StepIngredients now = some_step();
  now.options_json = R"({"faces":100})";
  const auto nearest = cache_.nearest(now);
  ASSERT_TRUE(nearest);
  EXPECT_THAT(differences(*nearest, now), testing::ElementsAre("faces was 80, is 100"));
  EXPECT_THAT(differences(far, some_step()),
              testing::ElementsAre("faces was 10, is 80", "the input surface has other content"));
}

TEST(CacheFolder, ComesFromTheEnvironment) {
  ::setenv("ORGANBAKE_CACHE", "/a", 1);
  EXPECT_EQ(Cache::default_folder(), "/a");
  ::unsetenv("ORGANBAKE_CACHE");
  ::setenv("XDG_CACHE_HOME", "/b", 1);
  EXPECT_EQ(Cache::default_folder(), "/b/organbake");
  ::unsetenv("XDG_CACHE_HOME");
  ::setenv("HOME", "/c", 1);
  EXPECT_EQ(Cache::default_folder(), "/c/.cache/organbake");
  ::unsetenv("HOME");
  EXPECT_EQ(Cache::default_folder(), Cache::temporary_folder()) << "no home, as in a container";
  ::setenv("HOME", "/dev/null/none", 1);
  EXPECT_EQ(Cache::default_folder(), Cache::temporary_folder()) << "a home that can't be written";
}

class ContentHashTest : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    fs::create_directories((path() / name).parent_path());
    write_file_atomically(path() / name, text);
  }
  std::string hash(InputKind kind, const std::string& name) {
    return content_hash(kind, path() / name, quick_hash_of_file);
  }
  fs::path path() const { return folder_.path(); }

  TemporaryFolder folder_;
};

TEST_F(ContentHashTest, AFilesNameDoesNotCount) {
  write("a.ply", "same");
  write("b.ply", "same");
  write("c.ply", "other");
  EXPECT_EQ(hash(InputKind::mesh, "a.ply"), hash(InputKind::mesh, "b.ply"));
  EXPECT_NE(hash(InputKind::mesh, "a.ply"), hash(InputKind::mesh, "c.ply"));
}

TEST_F(ContentHashTest, FilesLongerThanABlockAreReadToTheEnd) {
  std::string text(1000000, 'x');
  write("long", text);
  EXPECT_EQ(hash(InputKind::mesh, "long"), quick_hash(text));
  const std::string before = hash(InputKind::mesh, "long");
  text.back() = 'y';
  write("long", text);
  EXPECT_NE(hash(InputKind::mesh, "long"), before);
}

TEST_F(ContentHashTest, InAFolderNamesAndContentsCount) {
  write("s/1.dcm", "one");
  write("s/sub/2.dcm", "two");
  const std::string before = hash(InputKind::volume, "s");
  EXPECT_EQ(hash(InputKind::volume, "s"), before);
  fs::rename(path() / "s/1.dcm", path() / "s/0.dcm");
  EXPECT_NE(hash(InputKind::volume, "s"), before);
  fs::rename(path() / "s/0.dcm", path() / "s/1.dcm");
  write("s/1.dcm", "One");
  EXPECT_NE(hash(InputKind::volume, "s"), before);
}

TEST_F(ContentHashTest, AHeadersDataFileCounts) {
  write("v.mhd", "NDims = 3\nElementDataFile = v.raw\n");
  write("v.raw", "voxels");
  write("w.nhdr", "NRRD0004\ndata file: v.raw\n");
  const std::string before = hash(InputKind::volume, "v.mhd");
  const std::string nrrd_before = hash(InputKind::volume, "w.nhdr");
  write("v.raw", "Voxels");
  EXPECT_NE(hash(InputKind::volume, "v.mhd"), before);
  EXPECT_NE(hash(InputKind::volume, "w.nhdr"), nrrd_before);
  write("l.mhd", "ElementDataFile = LIST\nv.raw\n");
  const std::string list_before = hash(InputKind::volume, "l.mhd");
  write("v.raw", "voxels!");
  EXPECT_NE(hash(InputKind::volume, "l.mhd"), list_before);
}

TEST_F(ContentHashTest, BothFilesOfAPairCountWhicheverIsNamed) {
  write("a.hdr", "header");
  write("a.img", "voxels");
  const std::string before = hash(InputKind::volume, "a.hdr");
  EXPECT_EQ(hash(InputKind::volume, "a.img"), before);
  write("a.img", "others");
  EXPECT_NE(hash(InputKind::volume, "a.hdr"), before);
}

TEST_F(ContentHashTest, OneSliceStandsForWhatLiesBesideIt) {
  const std::string dicom = std::string(128, '\0') + "DICM";
  write("s/1", dicom + "one");
  write("s/2", dicom + "two");
  const std::string before = hash(InputKind::volume, "s/1");
  EXPECT_NE(hash(InputKind::volume, "s/2"), before) << "another series may be meant";
  write("s/2", dicom + "three");
  EXPECT_NE(hash(InputKind::volume, "s/1"), before);
}

TEST_F(ContentHashTest, ThePhotographsOfADocumentCount) {
  CameraSet set;
  set.cameras.resize(1);
  set.cameras[0].name = "p";
  set.cameras[0].intrinsics = {.width = 4, .height = 4, .fx = 1, .fy = 1, .cx = 2, .cy = 2};
  set.images = {"p.png"};
  write("p/cameras.json", cameras_to_json(set));
  EXPECT_THROW(hash(InputKind::photos, "p/cameras.json"), NoInputError) << "its image is missing";
  write("p/p.png", "pixels");
  const std::string before = hash(InputKind::photos, "p/cameras.json");
  write("p/p.png", "Pixels");
  EXPECT_NE(hash(InputKind::photos, "p/cameras.json"), before);
}

TEST_F(ContentHashTest, TheBuffersOfAGltfDocumentCount) {
  write("m/a.gltf", R"({"buffers":[{"uri":"a%20b.bin"},{"uri":"data:;base64,AA=="},{}]})");
  write("m/a b.bin", "places");
  const std::string before = hash(InputKind::mesh, "m/a.gltf");
  write("m/a b.bin", "Places");
  EXPECT_NE(hash(InputKind::mesh, "m/a.gltf"), before);
  write("m/b.gltf", "no JSON");
  EXPECT_NO_THROW(hash(InputKind::mesh, "m/b.gltf")) << "its reader tells why";
}

TEST_F(ContentHashTest, AllFilesOfAColmapModelCountWhicheverIsNamed) {
  for (const char* name : {"cameras", "images", "rigs", "frames"})
    write("c/" + std::string(name) + ".txt", name);
  for (const char* changed : {"cameras", "rigs", "frames"}) {
    const std::string before = hash(InputKind::posed, "c/images.txt");
    write("c/" + std::string(changed) + ".txt", "changed");
    EXPECT_NE(hash(InputKind::posed, "c/images.txt"), before) << changed;
  }
}

TEST_F(ContentHashTest, WhatIsNotThereIsRefused) {
  EXPECT_THROW(hash(InputKind::mesh, "missing"), NoInputError);
  fs::create_directory(path() / "empty");
  EXPECT_THROW(hash(InputKind::volume, "empty"), NoInputError);
  EXPECT_THROW(hash(InputKind::mesh, "empty"), NoInputError);
  EXPECT_THROW(hash(InputKind::mesh, "/dev/null"), NoInputError);
}

}  // namespace
}  // namespace organbake
