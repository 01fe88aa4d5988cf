// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom.h"

void organbake_dicom(organbake::DicomReaders& readers) {
  readers = {organbake::read_dicom, organbake::mask_among, organbake::contents_of};
}
