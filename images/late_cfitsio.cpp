// SPDX-License-Identifier: Apache-2.0
// Lazily loaded stub of cfitsio: functions with cfitsio's names that forward to the library, which is loaded
// by the first call. cfitsio depends on 27 libraries (it can read over the network), and a program linked to
// it spends half of its start-up on loading them. Linked into `obscurad` only, before cfitsio, so that
// cfitsio itself is not needed; a function missing here makes it needed again, and the test `late_libraries`
// fails.
#include "core/io/late_library.hpp"

#include <fitsio.h>

namespace {

template<typename Function>
Function* late(Function* like, const char* name) {
    static const obscura::LateLibrary cfitsio(OBSCURA_CFITSIO, "reading and writing FITS files");
    return cfitsio.find(like, name);
}

} // namespace

extern "C" {
int ffclos(fitsfile* fptr, int* status) {
    static auto* const call = late(&ffclos, "ffclos");
    return call(fptr, status);
}

void ffcmsg() {
    static auto* const call = late(&ffcmsg, "ffcmsg");
    call();
}

int ffcrim(fitsfile* fptr, int bitpix, int naxis, long* naxes, int* status) {
    static auto* const call = late(&ffcrim, "ffcrim");
    return call(fptr, bitpix, naxis, naxes, status);
}

int ffcrtb(fitsfile* fptr, int tbltype, LONGLONG naxis2, int tfields, char** ttype, char** tform,
           char** tunit, const char* extname, int* status) {
    static auto* const call = late(&ffcrtb, "ffcrtb");
    return call(fptr, tbltype, naxis2, tfields, ttype, tform, tunit, extname, status);
}

int ffdelt(fitsfile* fptr, int* status) {
    static auto* const call = late(&ffdelt, "ffdelt");
    return call(fptr, status);
}

int ffdkinit(fitsfile** fptr, const char* filename, int* status) {
    static auto* const call = late(&ffdkinit, "ffdkinit");
    return call(fptr, filename, status);
}

int ffdkopn(fitsfile** fptr, const char* filename, int iomode, int* status) {
    static auto* const call = late(&ffdkopn, "ffdkopn");
    return call(fptr, filename, iomode, status);
}

void ffgerr(int status, char* errtext) {
    static auto* const call = late(&ffgerr, "ffgerr");
    call(status, errtext);
}

int ffghadll(fitsfile* fptr, LONGLONG* headstart, LONGLONG* datastart, LONGLONG* dataend, int* status) {
    static auto* const call = late(&ffghadll, "ffghadll");
    return call(fptr, headstart, datastart, dataend, status);
}

int ffghdt(fitsfile* fptr, int* exttype, int* status) {
    static auto* const call = late(&ffghdt, "ffghdt");
    return call(fptr, exttype, status);
}

int ffgidm(fitsfile* fptr, int* naxis, int* status) {
    static auto* const call = late(&ffgidm, "ffgidm");
    return call(fptr, naxis, status);
}

int ffgiet(fitsfile* fptr, int* imgtype, int* status) {
    static auto* const call = late(&ffgiet, "ffgiet");
    return call(fptr, imgtype, status);
}

int ffgipr(fitsfile* fptr, int maxaxis, int* imgtype, int* naxis, long* naxes, int* status) {
    static auto* const call = late(&ffgipr, "ffgipr");
    return call(fptr, maxaxis, imgtype, naxis, naxes, status);
}

int ffgisz(fitsfile* fptr, int nlen, long* naxes, int* status) {
    static auto* const call = late(&ffgisz, "ffgisz");
    return call(fptr, nlen, naxes, status);
}

int ffgky(fitsfile* fptr, int datatype, const char* keyname, void* value, char* comm, int* status) {
    static auto* const call = late(&ffgky, "ffgky");
    return call(fptr, datatype, keyname, value, comm, status);
}

int ffgmsg(char* err_message) {
    static auto* const call = late(&ffgmsg, "ffgmsg");
    return call(err_message);
}

int ffgpv(fitsfile* fptr, int datatype, LONGLONG firstelem, LONGLONG nelem, void* nulval, void* array,
          int* anynul, int* status) {
    static auto* const call = late(&ffgpv, "ffgpv");
    return call(fptr, datatype, firstelem, nelem, nulval, array, anynul, status);
}

int ffgpxv(fitsfile* fptr, int datatype, long* firstpix, LONGLONG nelem, void* nulval, void* array,
           int* anynul, int* status) {
    static auto* const call = late(&ffgpxv, "ffgpxv");
    return call(fptr, datatype, firstpix, nelem, nulval, array, anynul, status);
}

int ffmahd(fitsfile* fptr, int hdunum, int* exttype, int* status) {
    static auto* const call = late(&ffmahd, "ffmahd");
    return call(fptr, hdunum, exttype, status);
}

int ffmnhd(fitsfile* fptr, int exttype, char* hduname, int hduvers, int* status) {
    static auto* const call = late(&ffmnhd, "ffmnhd");
    return call(fptr, exttype, hduname, hduvers, status);
}

int ffpcl(fitsfile* fptr, int datatype, int colnum, LONGLONG firstrow, LONGLONG firstelem, LONGLONG nelem,
          void* array, int* status) {
    static auto* const call = late(&ffpcl, "ffpcl");
    return call(fptr, datatype, colnum, firstrow, firstelem, nelem, array, status);
}

int ffpcom(fitsfile* fptr, const char* comm, int* status) {
    static auto* const call = late(&ffpcom, "ffpcom");
    return call(fptr, comm, status);
}

int ffpkls(fitsfile* fptr, const char* keyname, const char* value, const char* comm, int* status) {
    static auto* const call = late(&ffpkls, "ffpkls");
    return call(fptr, keyname, value, comm, status);
}

int ffpky(fitsfile* fptr, int datatype, const char* keyname, void* value, const char* comm, int* status) {
    static auto* const call = late(&ffpky, "ffpky");
    return call(fptr, datatype, keyname, value, comm, status);
}

int ffpkyd(fitsfile* fptr, const char* keyname, double value, int decim, const char* comm, int* status) {
    static auto* const call = late(&ffpkyd, "ffpkyd");
    return call(fptr, keyname, value, decim, comm, status);
}

int ffplsw(fitsfile* fptr, int* status) {
    static auto* const call = late(&ffplsw, "ffplsw");
    return call(fptr, status);
}

int ffppr(fitsfile* fptr, int datatype, LONGLONG firstelem, LONGLONG nelem, void* array, int* status) {
    static auto* const call = late(&ffppr, "ffppr");
    return call(fptr, datatype, firstelem, nelem, array, status);
}

int ffthdu(fitsfile* fptr, int* nhdu, int* status) {
    static auto* const call = late(&ffthdu, "ffthdu");
    return call(fptr, nhdu, status);
}

int ffuky(fitsfile* fptr, int datatype, const char* keyname, void* value, const char* comm, int* status) {
    static auto* const call = late(&ffuky, "ffuky");
    return call(fptr, datatype, keyname, value, comm, status);
}

int fits_is_compressed_image(fitsfile* fptr, int* status) {
    static auto* const call = late(&fits_is_compressed_image, "fits_is_compressed_image");
    return call(fptr, status);
}
} // extern "C"
