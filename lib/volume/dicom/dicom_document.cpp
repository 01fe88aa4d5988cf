// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the data elements of one DICOM file (PS3.5, PS3.10) by vtk-dicom: deflated files are
// inflated before, its complaints are gathered, and what an image or a frame says of its place and
// its pixels becomes a DicomSlice.
#include "dicom/dicom_document.h"

#include <sys/mman.h>
#include <unistd.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkDICOMParser.h>
#include <vtkDICOMUtilities.h>
#include <zlib.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>

#include "files/volume_files.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

namespace organbake {
namespace {

// "ERROR: In ./X.cxx, line 12\nvtkX (0x55…): words\n\n" → "words". vtk-dicom nests such texts, so
// the last address in the text is the one to cut at.
std::string own_words(const char* text) {
  std::string words = text ? text : "";
  const std::size_t address = words.rfind("): ");
  if (address != std::string::npos && words.find("(0x") < address) words.erase(0, address + 3);
  for (char& c : words)
    if (c == '\n' || c == '\r') c = ' ';
  words = trimmed(words, " ");
  return words.empty() ? "VTK could not read it" : words;
}

// VTK reports errors as events, and prints them when nobody listens. The first one's own words are
// kept. (What is deep inside VTK can still write to its process-wide log.)
void remember(vtkObject*, unsigned long event, void* fault, void* text) {
  auto& first = *static_cast<std::string*>(fault);
  if (event == vtkCommand::ErrorEvent && first.empty())
    first = own_words(static_cast<const char*>(text));
}

namespace fs = std::filesystem;

constexpr std::size_t kPreamble = 132;
constexpr std::size_t kLongestMeta = 4096;
constexpr std::size_t kLargestInflated = std::size_t{1} << 28;  // of one slice
const std::string kDeflatedSyntax = "1.2.840.10008.1.2.1.99";
const std::string kExplicit = "1.2.840.10008.1.2.1";  // what it is once inflated

// Where the data set begins, by the meta group's own length, its first element.
std::optional<std::size_t> end_of_meta(const std::string& bytes) {
  if (bytes.size() < kPreamble + 12 || !starts_dicom(bytes)) return std::nullopt;
  if (bytes.compare(kPreamble, 8, std::string("\2\0\0\0UL\4\0", 8)) != 0) return std::nullopt;
  const std::size_t end = kPreamble + 12 + whole_at(bytes, kPreamble + 8, 4, false);
  return end <= bytes.size() ? std::optional(end) : std::nullopt;
}

std::optional<std::string> inflated(const std::string& bytes, std::size_t from) {
  z_stream stream{};
  constexpr int kRawDeflate = -MAX_WBITS;
  if (inflateInit2(&stream, kRawDeflate) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + from));
  stream.avail_in = static_cast<uInt>(bytes.size() - from);
  std::string out, piece(std::size_t{1} << 18, '\0');
  int state = Z_OK;
  while (state == Z_OK && out.size() < kLargestInflated) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    state = inflate(&stream, Z_NO_FLUSH);
    out.append(piece, 0, piece.size() - stream.avail_out);
  }
  inflateEnd(&stream);
  return state == Z_STREAM_END ? std::optional(std::move(out)) : std::nullopt;
}

bool write_all(int descriptor, const std::string& bytes) {
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t written = ::write(descriptor, bytes.data() + at, bytes.size() - at);
    if (written <= 0) return false;
    at += static_cast<std::size_t>(written);
  }
  return true;
}

// The file with its data set inflated and its transfer syntax renamed; the shorter name is filled
// up with the zeros that UIDs are padded with.
std::optional<std::string> as_explicit(const fs::path& file) {
  const std::string start = beginning_of(file, kLongestMeta);
  if (start.find(kDeflatedSyntax) == std::string::npos) return std::nullopt;
  const auto meta = end_of_meta(start);
  if (!meta || start.find(kDeflatedSyntax) >= *meta) return std::nullopt;
  std::error_code error;
  if (fs::file_size(file, error) > kLargestInflated || error) return std::nullopt;
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  auto data_set = inflated(bytes, *meta);
  if (!data_set) return std::nullopt;
  std::string head = bytes.substr(0, *meta);
  head.replace(head.find(kDeflatedSyntax), kDeflatedSyntax.size(),
               kExplicit + std::string(kDeflatedSyntax.size() - kExplicit.size(), '\0'));
  return head + *data_set;
}

}  // namespace

std::string beginning_of(const fs::path& file, std::size_t bytes) {
  std::string start(bytes, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(stream.gcount()));
  return start;
}

ReadableDicom::ReadableDicom(const fs::path& file) : path_(file) {
  const auto bytes = as_explicit(file);
  if (!bytes) return;
  memory_ = ::memfd_create("organbake-dicom", MFD_CLOEXEC);
  if (memory_ < 0 || !write_all(memory_, *bytes)) return;
  path_ = "/proc/self/fd/" + std::to_string(memory_);
}

ReadableDicom::~ReadableDicom() {
  if (memory_ >= 0) ::close(memory_);
}

DicomDocument::DicomDocument(const fs::path& file)
    : file_(file), readable_(file), fault_(flaw_of_dicom(readable_.path())) {
  if (!fault_.empty()) return;
  vtkNew<vtkCallbackCommand> listener;
  listener->SetClientData(&fault_);
  listener->SetCallback(remember);
  vtkNew<vtkDICOMParser> parser;
  parser->AddObserver(vtkCommand::ErrorEvent, listener);
  parser->AddObserver(vtkCommand::WarningEvent, listener);
  parser->SetMetaData(data_);
  parser->SetFileName(readable_.path().c_str());
  parser->Update();
  pixel_offset_ = static_cast<std::uint64_t>(std::max<vtkTypeInt64>(0, parser->GetFileOffset()));
  pixel_bytes_ = parser->GetPixelDataFound() ? parser->GetPixelDataVL() : 0;
}

void DicomDocument::check() const {
  if (!fault_.empty()) throw BadDataError(file_, fault_);
}

std::string DicomDocument::text(vtkDICOMTag tag) const { return dicom_text(data_->Get(tag)); }

std::string dicom_text(const vtkDICOMValue& value) { return trimmed(value.AsString()); }

DicomMaskKind dicom_mask_kind(const std::filesystem::path& file) {
  const std::string kind = DicomDocument(file).text(DC::SOPClassUID);
  if (kind == "1.2.840.10008.5.1.4.1.1.66.4" || kind == "1.2.840.10008.5.1.4.1.1.66.7")
    return DicomMaskKind::segmentation;
  return kind == "1.2.840.10008.5.1.4.1.1.481.3" ? DicomMaskKind::contours : DicomMaskKind::none;
}

std::filesystem::path mask_among(std::vector<std::filesystem::path> files,
                                 const std::filesystem::path& folder) {
  std::erase_if(files,
                [](const auto& file) { return dicom_mask_kind(file) == DicomMaskKind::none; });
  if (files.size() > 1)
    throw BadDataError(folder, "holds " + std::to_string(files.size()) + " masks (" +
                                   named_files(files) + "); give one of these files");
  return files.empty() ? std::filesystem::path() : files.front();
}

namespace {

constexpr const char* kCtImageStorage = "1.2.840.10008.5.1.4.1.1.2";
constexpr int kMostFrames = 65535;
constexpr const char* kDirectoryClass = "1.2.840.10008.1.3.10";

int integer(vtkDICOMMetaData& data, vtkDICOMTag tag, int otherwise) {
  return data.Has(tag) ? data.Get(tag).AsInt() : otherwise;
}

bool finite_numbers(const vtkDICOMValue& value, std::size_t count, double* out) {
  if (value.GetNumberOfValues() != count) return false;
  for (std::size_t i = 0; i < count; ++i) out[i] = value.GetDouble(i);
  return std::all_of(out, out + count, [](double x) { return std::isfinite(x); });
}

// A frame's own value, else what all of its file share.
const vtkDICOMValue& of_frame(vtkDICOMMetaData& data, const DicomSlice& slice, vtkDICOMTag tag) {
  return data.Get(0, slice.frame, tag);
}

void read_geometry(vtkDICOMMetaData& data, DicomSlice& slice) {
  double position[3], orientation[6], spacing[2];
  if (!finite_numbers(of_frame(data, slice, DC::ImagePositionPatient), 3, position) ||
      !finite_numbers(of_frame(data, slice, DC::ImageOrientationPatient), 6, orientation) ||
      !finite_numbers(of_frame(data, slice, DC::PixelSpacing), 2, spacing))
    return;
  slice.position_mm = Eigen::Map<const Eigen::Vector3d>(position);
  slice.row_axis = Eigen::Map<const Eigen::Vector3d>(orientation);
  slice.column_axis = Eigen::Map<const Eigen::Vector3d>(orientation + 3);
  // DICOM gives the distance between rows first, which lies along the column axis.
  slice.pixel_mm = {spacing[1], spacing[0]};
  slice.has_geometry = true;
}

// The padding is written unsigned by some scanners whose pixels are signed, and the other way
// round: only its 16 bits count.
int as_stored(int value, bool is_signed) {
  const auto bits = static_cast<std::uint16_t>(value);
  return is_signed ? static_cast<std::int16_t>(bits) : bits;
}

DicomPixels pixels_from(const DicomDocument& document) {
  vtkDICOMMetaData& data = document.data();
  DicomPixels pixels;
  pixels.transfer_syntax = document.text(DC::TransferSyntaxUID);
  pixels.big_endian = pixels.transfer_syntax == "1.2.840.10008.1.2.2";
  pixels.photometric = document.text(DC::PhotometricInterpretation);
  pixels.bits_allocated = integer(data, DC::BitsAllocated, 16);
  pixels.bits_stored = integer(data, DC::BitsStored, pixels.bits_allocated);
  pixels.is_signed = integer(data, DC::PixelRepresentation, 0) != 0;
  pixels.samples = integer(data, DC::SamplesPerPixel, 1);
  pixels.frames = integer(data, DC::NumberOfFrames, 1);
  pixels.present = document.pixel_bytes() > 0;
  pixels.offset = document.pixel_offset();
  pixels.bytes = document.pixel_bytes();
  if (data.Has(DC::PixelPaddingValue)) {
    const int value = data.Get(DC::PixelPaddingValue).AsInt();
    const int first = as_stored(value, pixels.is_signed);
    const int last = as_stored(integer(data, DC::PixelPaddingRangeLimit, value), pixels.is_signed);
    pixels.padding = {std::min(first, last), std::max(first, last)};
  }
  return pixels;
}

void read_what_tells_apart(vtkDICOMMetaData& data, DicomSlice& slice) {
  const std::pair<const char*, vtkDICOMTag> kTelling[] = {
      {"temporal position", DC::TemporalPositionIdentifier},
      {"temporal position", DC::TemporalPositionIndex},
      {"phase of the cycle, %", DC::NominalPercentageOfCardiacPhase},
      {"phase of the cycle, %", DC::NominalPercentageOfRespiratoryPhase},
      {"trigger time, ms", DC::TriggerTime},
      {"trigger time, ms", DC::NominalCardiacTriggerDelayTime},
      {"acquisition", DC::AcquisitionNumber},
      {"reconstruction kernel", DC::ConvolutionKernel},
      {"acquisition time", DC::AcquisitionTime},
      {"acquisition time", DC::AcquisitionDateTime},
      {"acquisition time", DC::FrameAcquisitionDateTime},
      {"acquisition time", DC::FrameReferenceDateTime},
      {"image type", DC::ImageType}};
  for (const auto& [what, tag] : kTelling) {
    const std::string value = dicom_text(of_frame(data, slice, tag));
    if (!value.empty()) slice.told_apart_by.emplace_back(what, value);
  }
}

DicomSlice slice_from(const DicomDocument& document, const fs::path& file) {
  DicomSlice slice;
  slice.file = file;
  slice.series_uid = document.text(DC::SeriesInstanceUID);
  slice.series_number = document.text(DC::SeriesNumber);
  slice.frame_of_reference_uid = document.text(DC::FrameOfReferenceUID);
  slice.series_description = document.text(DC::SeriesDescription);
  slice.modality = document.text(DC::Modality);
  slice.is_localizer = document.text(DC::ImageType).find("LOCALIZER") != std::string::npos;
  slice.rows = document.data().Get(DC::Rows).AsInt();
  slice.columns = document.data().Get(DC::Columns).AsInt();
  slice.pixels = pixels_from(document);
  return slice;
}

// vtk-dicom's own test also knows files without the preamble, but wants 256 bytes.
bool is_dicom(const fs::path& file) {
  return starts_dicom(beginning_of(file, kPreamble)) ||
         vtkDICOMUtilities::IsDICOMFile(file.c_str());
}

// A description is kept of every frame, before anybody looks for its pixels: an item of eight bytes
// at least, or several times that in a functional group.
bool can_hold(const fs::path& file, int frames) {
  constexpr std::uintmax_t kLeastFrame = 8;
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file, error);
  return frames <= 1 || (!error && static_cast<std::uintmax_t>(frames) <= bytes / kLeastFrame);
}

}  // namespace

void read_frame(vtkDICOMMetaData& data, int frame, DicomSlice& slice) {
  slice.frame = frame;
  const vtkDICOMValue& slope = of_frame(data, slice, DC::RescaleSlope);
  const vtkDICOMValue& intercept = of_frame(data, slice, DC::RescaleIntercept);
  if (slope.IsValid()) slice.slope = slope.AsDouble();
  if (intercept.IsValid()) slice.intercept = intercept.AsDouble();
  const std::string kind = dicom_text(of_frame(data, slice, DC::FrameType));
  slice.is_localizer |= kind.find("LOCALIZER") != std::string::npos;
  read_geometry(data, slice);
  read_what_tells_apart(data, slice);
}

ScannedFile scan_dicom_file(const fs::path& file) {
  ScannedFile scanned;
  scanned.file = file;
  scanned.is_dicom = is_dicom(file);
  if (!scanned.is_dicom) return scanned;
  const DicomDocument document(file);
  vtkDICOMMetaData& data = document.data();
  scanned.reason = document.fault();
  scanned.damaged = !scanned.reason.empty();
  if (scanned.damaged) return scanned;
  if (!data.Has(DC::Rows) || !data.Has(DC::Columns)) {
    // A report or a directory has no rows; a CT slice without them was cut off.
    const std::string kind = document.text(DC::SOPClassUID);
    const bool other = !kind.empty() && kind != kCtImageStorage;
    const bool directory = document.text(DC::MediaStorageSOPClassUID) == kDirectoryClass;
    scanned.damaged = !other && !directory;
    scanned.reason = scanned.damaged ? "ends before its image" : "holds no image";
    return scanned;
  }
  DicomSlice first = slice_from(document, file);
  read_frame(data, 0, first);
  const int frames = first.pixels.frames;
  scanned.damaged = !can_hold(document.readable(), frames);
  if (scanned.damaged) {
    scanned.reason = "claims " + std::to_string(frames) + " frames, which it cannot hold";
    return scanned;
  }
  scanned.slice = first;
  first.told_apart_by.clear();
  first.has_geometry = false;
  for (int frame = 1; frame < std::min(frames, kMostFrames); ++frame)
    read_frame(data, frame, scanned.later_frames.emplace_back(first));
  return scanned;
}

}  // namespace organbake
