// SPDX-License-Identifier: GPL-3.0-or-later
#include "fuzz/vtk_writings.h"

#include <vtkXMLWriter.h>

namespace organbake {

Seeds vtk_writings(vtkXMLWriter& writer) {
  struct Form {
    int mode;
    bool base64;  // of appended data
    int compressor, byte_order, counts;
  };
  using W = vtkXMLWriter;
  static constexpr Form kForms[] = {
      {W::Ascii, true, W::NONE, W::LittleEndian, W::UInt32},
      {W::Binary, true, W::NONE, W::BigEndian, W::UInt32},
      {W::Binary, true, W::ZLIB, W::LittleEndian, W::UInt64},
      {W::Appended, true, W::ZLIB, W::BigEndian, W::UInt32},
      {W::Appended, false, W::NONE, W::LittleEndian, W::UInt64},
      {W::Appended, false, W::ZLIB, W::LittleEndian, W::UInt32},
  };
  constexpr int kBlockBytes = 64;  // several blocks, the last one cut short
  Seeds seeds;
  writer.WriteToOutputStringOn();
  writer.SetBlockSize(kBlockBytes);
  for (const Form& form : kForms) {
    writer.SetDataMode(form.mode);
    writer.SetEncodeAppendedData(form.base64);
    writer.SetCompressorType(form.compressor);
    writer.SetByteOrder(form.byte_order);
    writer.SetHeaderType(form.counts);
    writer.Write();
    seeds.push_back(writer.GetOutputString());
  }
  return seeds;
}

std::string vtk_lz4_writing(vtkXMLWriter& writer) {
  writer.WriteToOutputStringOn();
  writer.SetDataModeToAppended();
  writer.SetCompressorTypeToLZ4();
  writer.Write();
  return writer.GetOutputString();
}

}  // namespace organbake
