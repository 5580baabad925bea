#!/bin/sh
# Make sure of the system libraries that Blender as a Python module loads, and, with the argument
# open3d, of those that this peer of the benchmark loads as well.
#
# Where they are missing they are installed with apt if that is allowed; else the one command to
# run is printed.
[ "$(uname -s)" = Linux ] || exit 0

open3d=
[ "$1" != open3d ] || open3d="libusb-1.0-0 libusb-1.0.so.0"

# ldconfig stands in a folder that is not on every user's PATH.
known=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
missing=
while read -r package library; do
    case $known in
        *"$library "*) ;;
        *) missing="$missing $package" ;;
    esac
done <<LIST
libegl1 libEGL.so.1
libgl1 libGL.so.1
libxi6 libXi.so.6
libxxf86vm1 libXxf86vm.so.1
libxfixes3 libXfixes.so.3
libxrender1 libXrender.so.1
libxkbcommon0 libxkbcommon.so.0
libsm6 libSM.so.6
libice6 libICE.so.6
$open3d
LIST

# The software renderer is a set of drivers that ldconfig does not list.
if command -v dpkg-query >/dev/null &&
    ! dpkg-query --show --showformat '${Status}' libgl1-mesa-dri 2>/dev/null | grep -q ' installed$'
then
    missing="$missing libgl1-mesa-dri"
fi

[ -z "$missing" ] || "$(dirname "$0")/apt.sh" $missing
