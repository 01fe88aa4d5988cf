// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/unzipped_folder.h"

#include <gmock/gmock.h>
#include <minizip/zip.h>

#include "dicom_folder_fixture.h"
#include "organbake/core/files.h"
#include "support/error_message.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

void write_zip(const fs::path& path,
               const std::vector<std::pair<std::string, std::string>>& files) {
  zipFile zip = zipOpen64(path.c_str(), APPEND_STATUS_CREATE);
  for (const auto& [name, bytes] : files) {
    zip_fileinfo info{};
    zipOpenNewFileInZip64(zip, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, 6,
                          0);
    zipWriteInFileInZip(zip, bytes.data(), static_cast<unsigned>(bytes.size()));
    zipCloseFileInZip(zip);
  }
  zipClose(zip, nullptr);
}

class ZippedSeries : public DicomFolderTest {
 protected:
  ZippedSeries() { add_stack({0, 2, 4}, Eigen::Matrix3d::Identity()); }
  std::string slice(int number) const {
    const auto bytes = read_file(folder_.path() / ("slice" + std::to_string(number)));
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }
  // In two folders, as a disc has them, with what macOS and people add.
  std::vector<std::pair<std::string, std::string>> packed() const {
    return {{"IMG/a/0001", slice(1)},
            {"IMG/a/0002", slice(2)},
            {"IMG/b/0001", slice(3)},
            {"IMG/b/", ""},
            {"__MACOSX/IMG/a/._0001", "companion"},
            {"read me.txt", "a note"}};
  }
  std::string refusal() const {
    return message_of(ExitCode::bad_data, [&] { read_volume(zip_, VolumeReadOptions{}); });
  }
  TemporaryFolder beside_;
  fs::path zip_ = beside_.path() / "series.zip";
};

TEST_F(ZippedSeries, IsReadAsItsFolder) {
  write_zip(zip_, packed());
  const Volume zipped = read_volume(zip_, VolumeReadOptions{}), loose = read();
  EXPECT_EQ(zipped.voxels, loose.voxels);
  EXPECT_EQ(zipped.origin_mm, loose.origin_mm);
  EXPECT_EQ(zipped.size, loose.size);
  for (const std::string& warning : zipped.warnings)
    EXPECT_EQ(warning.find("organbake-"), std::string::npos) << "a temporary folder: " << warning;
}

TEST_F(ZippedSeries, WhatIsNoneIsRefusedByItsName) {
  write_zip(zip_, {{"note.txt", "no scan"}});
  EXPECT_THAT(refusal(), testing::AllOf(HasSubstr("series.zip"), HasSubstr("is not a volume")));
  write_zip(zip_, {{"a.txt", "no scan"}, {"b.txt", "either"}});
  EXPECT_THAT(refusal(), HasSubstr("series.zip"));
  write_zip(zip_, {{"__MACOSX/._a", "x"}});
  EXPECT_THAT(refusal(), HasSubstr("without files"));
  const TemporaryFolder inner;
  write_zip(inner.path() / "in.zip", packed());
  write_zip(zip_, {{"in.zip", read_text_file(inner.path() / "in.zip")}});
  EXPECT_THAT(refusal(), HasSubstr("another zip"));
}

TEST_F(ZippedSeries, NothingIsWrittenOutsideItsFolder) {
  std::vector<std::pair<std::string, std::string>> files = packed();
  files.push_back({"../../../escaped", slice(1)});
  write_zip(zip_, files);
  const UnzippedFolder unzipped(zip_);
  EXPECT_EQ(list_files(unzipped.path()).size(), 5u);
  EXPECT_FALSE(fs::exists(unzipped.path().parent_path() / "escaped"));
}

TEST_F(ZippedSeries, ADamagedZipIsRefused) {
  write_zip(zip_, packed());
  const std::vector<std::byte> good = read_file(zip_);
  for (const std::size_t cut :
       {std::size_t{22}, std::size_t{60}, good.size() / 2}) {  // 22: the end record
    write_file_atomically(zip_, std::span(good).first(good.size() - cut));
    EXPECT_THAT(refusal(), HasSubstr("series.zip"));
  }
  std::vector<std::byte> bad = good;
  bad[60] ^= std::byte{0x55};  // within the first file's bytes: its checksum tells
  write_file_atomically(zip_, bad);
  EXPECT_THAT(refusal(), HasSubstr("damaged zip"));
}

}  // namespace
}  // namespace organbake
