#!/usr/bin/env bash
# make_sysroot.sh FOLDER PACKAGE...: unpacks these packages of Debian 12 for arm64, and all that they depend on, into a
# folder. None of their programs runs here: what installing them would do for a compiler and for qemu-aarch64 is done
# by this script.
set -euo pipefail
folder=$1
shift
making=$folder.making
rm -rf "$making" "$folder"
mmdebstrap --architectures=arm64 --variant=extract --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
  --aptopt='Apt::Install-Recommends "false"' --include="$(IFS=,; echo "$*")" bookworm "$making" >"$folder.log" 2>&1 ||
  { tail -n 20 "$folder.log" >&2; exit 1; }
libraries=$making/usr/lib/aarch64-linux-gnu
# The links of update-alternatives: the reference BLAS and LAPACK where both are there.
for library in atlas blas lapack; do
  for file in "$libraries/$library"/*.so*; do
    [ ! -e "$file" ] || ln -sf "$library/$(basename "$file")" "$libraries/"
  done
done
[ ! -e "$libraries/pkgconfig/hdf5-serial.pc" ] || ln -sf hdf5-serial.pc "$libraries/pkgconfig/hdf5.pc"
# A link or a path from the root would leave the folder.
find "$making" -xdev -type l -lname '/*' | while read -r link; do
  ln -sfrT "$making$(readlink "$link")" "$link"
done
for packages in "$making/usr/lib/cmake" "$libraries/cmake"; do
  [ ! -d "$packages" ] || find "$packages" -name '*.cmake' -exec \
    sed -i -E 's#(["; ])/usr/(lib|include)#\1${CMAKE_SYSROOT}/usr/\2#g' {} +
done
mv "$making" "$folder"
