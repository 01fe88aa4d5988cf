// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_masks.h"

#include <gmock/gmock.h>

#include "dicom_folder_fixture.h"
#include "volume/label_figures.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr const char* kSegmentation = "1.2.840.10008.5.1.4.1.1.66.4";
constexpr const char* kRle = "1.2.840.10008.1.2.5";
constexpr const char* kStructureSet = "1.2.840.10008.5.1.4.1.1.481.3";

std::string us(int value) { return dicom_number(static_cast<std::uint32_t>(value), 2); }

// Frames of 7×5 pixels, so that a frame's 35 bits end in the middle of a byte.
struct SegBytes {
  struct Frame {
    int segment;
    double z;
    std::vector<int> values;  // 35
  };
  std::string kind = "BINARY";
  int bits = 1;
  std::vector<Frame> frames;
  bool rle = false;

  std::string bytes() const {
    std::vector<std::string> groups, segments;
    std::string raw;
    std::size_t bit = 0;
    for (const Frame& frame : frames) {
      groups.push_back(
          dicom_sequence(0x20, 0x9113,
                         {dicom_element(0x20, 0x0032, "DS", "10\\-20\\" + to_text(frame.z))}) +
          dicom_sequence(0x62, 0x000A, {dicom_element(0x62, 0x000B, "US", us(frame.segment))}));
      for (const int value : frame.values) {
        if (bits == 8) raw += static_cast<char>(value);
        if (bits == 8) continue;
        if (bit % 8 == 0) raw += '\0';
        raw.back() = static_cast<char>(raw.back() | value << (bit % 8));
        ++bit;
      }
    }
    for (const char* name : {"liver", "cyst, large"}) {
      segments.push_back(
          dicom_element(0x62, 0x0004, "US", us(static_cast<int>(segments.size()) + 1)) +
          dicom_element(0x62, 0x0005, "LO", name));
    }
    const std::string shared =
        dicom_sequence(0x20, 0x9116, {dicom_element(0x20, 0x0037, "DS", "1\\0\\0\\0\\1\\0")}) +
        dicom_sequence(0x28, 0x9110, {dicom_element(0x28, 0x0030, "DS", "0.5\\0.75")});
    return dicom_head(kSegmentation, rle ? kRle : "1.2.840.10008.1.2.1") +
           dicom_element(8, 0x0016, "UI", kSegmentation) + dicom_element(8, 0x0060, "CS", "SEG") +
           dicom_element(0x28, 0x0008, "IS", std::to_string(frames.size())) +
           dicom_element(0x28, 0x0010, "US", us(5)) + dicom_element(0x28, 0x0011, "US", us(7)) +
           dicom_element(0x28, 0x0100, "US", us(bits)) +
           dicom_element(0x28, 0x0101, "US", us(bits)) +
           dicom_element(0x28, 0x0102, "US", us(bits - 1)) +
           dicom_element(0x62, 0x0001, "CS", kind) + dicom_sequence(0x62, 0x0002, segments) +
           (kind == "FRACTIONAL" ? dicom_element(0x62, 0x000E, "US", us(200)) : "") +
           dicom_sequence(0x5200, 0x9229, {shared}) + dicom_sequence(0x5200, 0x9230, groups) +
           (rle ? run_lengths() : dicom_element(0x7FE0, 0x0010, "OB", raw));
  }

  // Each frame's bytes as one segment (PS3.5, G): a run of zeros, then literals.
  std::string run_lengths() const {
    const auto item = [](std::string body) {
      if (body.size() % 2) body += '\0';
      return dicom_number(0xE000FFFE, 4) +
             dicom_number(static_cast<std::uint32_t>(body.size()), 4) + body;
    };
    std::string pixels = dicom_number(0x00107FE0, 4) + std::string("OB\0\0", 4) +
                         dicom_number(0xFFFFFFFF, 4) + item({});
    for (const Frame& frame : frames) {
      std::string segment;
      std::size_t zeros = 0;
      while (zeros < frame.values.size() && frame.values[zeros] == 0) ++zeros;
      if (zeros > 1) segment += {static_cast<char>(257 - zeros), '\0'};
      const std::size_t first = zeros > 1 ? zeros : 0;
      if (first < frame.values.size())
        segment += static_cast<char>(frame.values.size() - first - 1);
      for (std::size_t i = first; i < frame.values.size(); ++i)
        segment += static_cast<char>(frame.values[i]);
      pixels += item(dicom_number(1, 4) + dicom_number(64, 4) + std::string(56, '\0') + segment);
    }
    return pixels + dicom_number(0xE0DDFFFE, 4) + dicom_number(0, 4);
  }
};

std::vector<int> frame_with(std::initializer_list<int> set, int value = 1) {
  std::vector<int> values(35, 0);
  for (const int i : set) values[static_cast<std::size_t>(i)] = value;
  return values;
}

class DicomMasks : public ::testing::Test {
 protected:
  Volume read(const std::string& bytes, const std::string& label = {}) {
    write_bytes(file_, bytes);
    return read_volume(file_, {.label = label, .is_mask = true});
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "mask.dcm";
};

TEST_F(DicomMasks, SegmentsOverlapKeepTheirNamesAndLieWhereTheirFramesDo) {
  // The planes at 3 and 9 mm have no frame of the liver's: there is nothing of it.
  const SegBytes seg{"BINARY",
                     1,
                     {{1, 12, frame_with({8, 9, 34})},
                      {2, 6, frame_with({9})},
                      {1, 6, frame_with({9, 10})},
                      {2, 3, frame_with({0})}}};
  const Volume liver = read(seg.bytes(), "liver");
  EXPECT_EQ(liver.size, (std::array<int, 3>{7, 5, 4}));
  EXPECT_EQ(liver.spacing_mm, Eigen::Vector3d(0.75, 0.5, 3));
  EXPECT_EQ(liver.origin_mm, Eigen::Vector3d(10, -20, 3));
  EXPECT_EQ(label_figures(liver)[0].voxels, 5u);
  EXPECT_EQ(liver.at(1, 1, 3), 1);
  EXPECT_EQ(liver.at(6, 4, 3), 1) << "the last bit of a frame";
  EXPECT_EQ(liver.at(2, 1, 1), 1);
  EXPECT_EQ(liver.at(0, 0, 0), 0);
  const Volume cyst = read(seg.bytes(), "cyst, large");
  EXPECT_EQ(label_figures(cyst)[0].voxels, 2u);
  EXPECT_EQ(label_figures(cyst)[0].label, 2);
  EXPECT_EQ(label_figures(read(seg.bytes(), "1,2"))[0].voxels, 6u) << "together";
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "spleen"); }),
              HasSubstr("1 liver, 2 cyst, large"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "3"); }),
              HasSubstr("no label 3"));
}

TEST_F(DicomMasks, AFolderWithOneMaskStandsForIt) {
  const SegBytes seg{"BINARY", 1, {{1, 0, frame_with({3})}, {1, 2, frame_with({3, 4})}}};
  const Volume alone = read(seg.bytes(), "liver");
  const auto from_folder = [&] {
    return read_volume(folder_.path(), {.label = "liver", .is_mask = true});
  };
  EXPECT_EQ(from_folder().voxels, alone.voxels);
  write_bytes(folder_.path() / "other.dcm", seg.bytes());
  EXPECT_THAT(message_of(ExitCode::bad_data, from_folder), HasSubstr("holds 2 masks (mask.dcm, o"));
}

TEST_F(DicomMasks, AFractionalSegmentIsInsideFromOneHalfOn) {
  SegBytes seg{"FRACTIONAL", 8, {{1, 0, frame_with({3}, 99)}, {1, 2, frame_with({3, 4}, 100)}}};
  EXPECT_EQ(label_figures(read(seg.bytes(), "1"))[0].voxels, 2u);
}

TEST_F(DicomMasks, FramesCompressedByRunLengthsAreRead) {
  SegBytes seg{
      "FRACTIONAL",
      8,
      {{1, 0, frame_with({3, 20}, 200)}, {2, 0, frame_with({0, 34}, 150)}, {1, 2, frame_with({})}}};
  const Volume plain = read(seg.bytes(), "liver");
  seg.rle = true;
  EXPECT_EQ(read(seg.bytes(), "liver").voxels, plain.voxels);
  EXPECT_EQ(label_figures(read(seg.bytes(), "cyst, large"))[0].voxels, 2u);
  const std::string bytes = seg.bytes();
  message_of(ExitCode::bad_data, [&] { read(bytes.substr(0, bytes.size() - 30), "liver"); });
  SegBytes bits{"BINARY", 1, {{1, 0, frame_with({3})}}};
  bits.rle = true;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(bits.bytes(), "liver"); }),
              HasSubstr("save it uncompressed"));
}

TEST_F(DicomMasks, ATruncatedOrUnevenSegmentationIsRefused) {
  const SegBytes seg{
      "BINARY", 1, {{1, 0, frame_with({3})}, {1, 2, frame_with({3})}, {1, 5, frame_with({3})}}};
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(seg.bytes(), "1"); }),
              HasSubstr("uneven gaps"));
  SegBytes few = seg;
  few.frames.pop_back();
  std::string bytes = few.bytes();
  for (const std::size_t cut : {std::size_t{1}, std::size_t{6}, bytes.size() / 2}) {
    message_of(ExitCode::bad_data, [&] { read(bytes.substr(0, bytes.size() - cut), "1"); });
  }
}

// One region of interest of closed contours, each x, y of a plane.
struct Roi {
  std::string name;
  std::vector<std::pair<double, std::vector<Eigen::Vector2d>>> contours;
};

std::string structure_set(const std::vector<Roi>& regions,
                          const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity()) {
  std::vector<std::string> names, drawn;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const std::string number = std::to_string(i + 4);
    names.push_back(dicom_element(0x3006, 0x0022, "IS", number) +
                    dicom_element(0x3006, 0x0026, "LO", regions[i].name));
    std::vector<std::string> contours;
    for (const auto& [z, points] : regions[i].contours) {
      std::string data;
      for (const Eigen::Vector2d& p : points) {
        const Eigen::Vector3d world = axes * Eigen::Vector3d(p.x(), p.y(), z);
        for (int axis = 0; axis < 3; ++axis) {
          data += (data.empty() ? "" : "\\") + to_text(world[axis], 6);
        }
      }
      contours.push_back(dicom_element(0x3006, 0x0042, "CS", "CLOSED_PLANAR") +
                         dicom_element(0x3006, 0x0050, "DS", data));
    }
    drawn.push_back(dicom_sequence(0x3006, 0x0040, contours) +
                    dicom_element(0x3006, 0x0084, "IS", number));
  }
  return dicom_head(kStructureSet) + dicom_element(8, 0x0016, "UI", kStructureSet) +
         dicom_element(8, 0x0060, "CS", "RTSTRUCT") + dicom_sequence(0x3006, 0x0020, names) +
         dicom_sequence(0x3006, 0x0039, drawn);
}

std::vector<Eigen::Vector2d> circle(double x, double y, double radius, int points = 180) {
  std::vector<Eigen::Vector2d> all;
  for (int i = 0; i < points; ++i) {
    const double angle = 2 * M_PI * i / points;
    all.emplace_back(x + radius * std::cos(angle), y + radius * std::sin(angle));
  }
  return all;
}

// A tube of 15 planes at 2 mm, its hole once as a contour of its own, once by keyhole.
std::vector<Roi> tubes() {
  Roi own{"own hole", {}}, keyhole{"keyhole", {}};
  for (int k = 0; k < 15; ++k) {
    const double z = 100 + 2 * k;
    own.contours.push_back({z, circle(5, -30, 25)});
    own.contours.push_back({z, circle(5, -30, 10)});
    std::vector<Eigen::Vector2d> outer = circle(5, -30, 25), inner = circle(5, -30, 10);
    outer.push_back(outer.front());
    outer.insert(outer.end(), inner.rbegin(), inner.rend());
    outer.push_back(inner.back());
    keyhole.contours.push_back({z, outer});
  }
  return {own, keyhole};
}

TEST_F(DicomMasks, ContoursWithHolesAndKeyholesHaveTheirVolumeAndPlace) {
  const double right_ml = M_PI * (25 * 25 - 10 * 10) * 30 / 1000;
  for (const char* name : {"own hole", "keyhole"}) {
    const Volume mask = read(structure_set(tubes()), name);
    const LabelFigures figures = label_figures(mask)[0];
    EXPECT_NEAR(figures.volume_ml / right_ml, 1, 0.005) << name << ": the target is 1 %";
    const Eigen::Vector3d centre = (figures.min_mm + figures.max_mm) / 2;
    EXPECT_LT((centre - Eigen::Vector3d(5, -30, 114)).norm(), 0.15) << "a voxel's half, in x and y";
  }
}

TEST_F(DicomMasks, ObliqueContoursKeepTheirPlanes) {
  const Volume mask = read(structure_set(tubes(), oblique_direction()), "own hole");
  const double right_ml = M_PI * (25 * 25 - 10 * 10) * 30 / 1000;
  EXPECT_NEAR(label_figures(mask)[0].volume_ml / right_ml, 1, 0.01);
  EXPECT_NEAR(mask.direction.col(2).dot(oblique_direction().col(2)), 1, 1e-6);
}

TEST_F(DicomMasks, PlanesFarApartLeaveAGapAndOneMissingPlaneDoesNot) {
  Roi two{"two", {}};
  for (const double z : {0.0, 2.0, 4.0, 8.0, 10.0, 30.0, 32.0})
    two.contours.push_back({z, circle(0, 0, 10)});
  const Volume mask = read(structure_set({two}), "two");
  const auto at = [&](double z) {
    const Eigen::Vector3d index = mask.index_from_world({0, 0, z});
    return mask.at(static_cast<int>(std::lround(index.x())),
                   static_cast<int>(std::lround(index.y())),
                   static_cast<int>(std::lround(index.z())));
  };
  EXPECT_EQ(at(2), 4);
  EXPECT_EQ(at(6), 4) << "the plane that is missing";
  EXPECT_EQ(at(12), 0);
  EXPECT_EQ(at(20), 0);
  EXPECT_EQ(at(30), 4);
}

TEST_F(DicomMasks, WithoutClosedContoursThereIsNoMask) {
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [&] {
                           read(structure_set({{"empty", {}}}), "1");
                         }),
              HasSubstr("no closed contour"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(structure_set(tubes()), "liver"); }),
              HasSubstr("4 own hole, 5 keyhole"));
}

}  // namespace
}  // namespace organbake
