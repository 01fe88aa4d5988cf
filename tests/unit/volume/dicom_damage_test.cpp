// SPDX-License-Identifier: GPL-3.0-or-later
// Damaged files must be errors, never the end of the program: seeded byte flips in real files, in a
// child process that may neither crash, abort nor hang. ORGANBAKE_FUZZ_RUNS=5000 makes it a
// campaign; the default is a quick share of it.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <span>
#include <string>
#include <vector>

#include "dicom/dicom_pixels.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/volume/dicom_slice.h"
#include "organbake/volume/read_volume.h"
#include "support/dicom_bytes.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

constexpr std::size_t kHeaderBytes = 2048;
constexpr std::size_t kMostFlips = 6;

int runs() {
  const char* wanted = std::getenv("ORGANBAKE_FUZZ_RUNS");
  return wanted ? std::atoi(wanted) : 40;
}

// Every fourth run changes the first bytes of the compressed pixels instead of the header.
std::string spoiled(std::string bytes, std::uint64_t run, std::size_t pixel_offset) {
  RandomStream random(1234, run);
  const bool in_pixels = run % 4 == 3 && pixel_offset + kHeaderBytes < bytes.size();
  const std::size_t from = in_pixels ? pixel_offset : 0;
  const std::size_t flips = 1 + random.below(kMostFlips);
  for (std::size_t i = 0; i < flips; ++i) {
    bytes[from + random.below(kHeaderBytes)] = static_cast<char>(random.below(256));
  }
  if (run % 16 == 7) bytes.resize(random.below(bytes.size()));
  return bytes;
}

void read_slice(const std::filesystem::path& path) {
  const ScannedFile file = scan_dicom_file(path);
  if (!file.slice) return;
  Volume volume;
  volume.size = {file.slice->columns, file.slice->rows, 1};
  decode_slices(std::span(&*file.slice, 1), IndexBox::whole(volume), volume, {});
}

[[noreturn]] void read_spoiled_files(const std::string& name) {
  constexpr unsigned kHang_s = 10;
  const auto original = shared_data("dicom/transfer_syntaxes/" + name);
  const std::string bytes = read_bytes(original);
  const std::size_t pixel_offset = scan_dicom_file(original).slice->pixels.offset;
  const TemporaryFolder folder;
  const auto file = folder.path() / "slice";
  for (int run = 0; run < runs(); ++run) {
    ::alarm(kHang_s);
    write_bytes(file, spoiled(bytes, static_cast<std::uint64_t>(run), pixel_offset));
    try {
      read_slice(file);
    } catch (const Error&) {
    }
  }
  std::filesystem::remove_all(folder.path());
  ::_exit(0);
}

// A small stack of four slices with damage in one of them: series, places, gaps and the grid must
// bear with every header.
[[noreturn]] void read_spoiled_folders() {
  constexpr unsigned kHang_s = 10;
#ifndef __SANITIZE_ADDRESS__                   // whose shadow alone takes terabytes
  constexpr rlim_t kMemory = rlim_t{3} << 30;  // a lying header must not cost gigabytes
  const rlimit limit = {kMemory, kMemory};
  ::setrlimit(RLIMIT_AS, &limit);
#endif
  const TemporaryFolder folder;
  const auto file = [&](int k) { return folder.path() / std::to_string(k); };
  std::vector<std::string> slices;
  for (int k = 0; k < 4; ++k) {
    DicomBytes slice;
    slice.set_position({0, 0.1 * k, 2.0 * k});
    slice.pixels.assign(12, 1000);
    slices.push_back(slice.bytes());
    write_bytes(file(k), slices.back());
  }
  for (int run = 0; run < 20 * runs(); ++run) {
    ::alarm(kHang_s);
    RandomStream random(77, static_cast<std::uint64_t>(run));
    const int k = static_cast<int>(random.below(4));
    std::string bytes = slices[static_cast<std::size_t>(k)];
    // Digits become digits: wrong numbers go further than torn elements.
    for (std::uint64_t flips = 1 + random.below(kMostFlips); flips > 0; --flips) {
      char& c = bytes[132 + random.below(bytes.size() - 132)];
      const bool text = (c >= '0' && c <= '9') || c == '.' || c == '\\' || c == ' ';
      c = text ? "0123456789.-e"[random.below(13)] : static_cast<char>(random.below(256));
    }
    write_bytes(file(k), bytes);
    try {
      read_volume(folder.path());
    } catch (const Error&) {
    }
    write_bytes(file(k), slices[static_cast<std::size_t>(k)]);
  }
  std::filesystem::remove_all(folder.path());
  ::_exit(0);
}

TEST(DamagedDicomFolder, NeverEndsTheProgram) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(read_spoiled_folders(), ::testing::ExitedWithCode(0), "");
}

class DamagedDicom : public ::testing::TestWithParam<const char*> {};

TEST_P(DamagedDicom, NeverEndsTheProgram) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(read_spoiled_files(GetParam()), ::testing::ExitedWithCode(0), "");
}

INSTANTIATE_TEST_SUITE_P(
    RealFiles, DamagedDicom,
    ::testing::Values(
        "CTImage.dcm", "CTImage.dcm_LittleEndianImplicitTransferSyntax_1.2.840.10008.1.2.dcm",
        "CTImage.dcm_DeflatedExplicitVRLittleEndianTransferSyntax_1.2.840.10008.1.2.1.99.dcm",
        "CTImage.dcm_RLELosslessTransferSyntax_1.2.840.10008.1.2.5.dcm",
        "CTImage.dcm_JPEGProcess14SV1TransferSyntax_1.2.840.10008.1.2.4.70.dcm",
        "CTImage.dcm_JPEGLSLosslessTransferSyntax_1.2.840.10008.1.2.4.80.dcm", "CT1_J2KR"));

}  // namespace
}  // namespace organbake
