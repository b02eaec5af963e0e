#!/bin/sh
# Installs what the operating system lacks to run Shadowscope and its tests. Safe to run again.
# With --second-driver it also brings SwiftShader, another Vulkan driver in software, to target/swiftshader.
set -eu

# Vulkan loader and Mesa's drivers (a GPU's, and lavapipe for machines without one); client libraries that
# a window loads at run time (X11 and Wayland); Xvfb and xdotool for the window test; a C and C++ compiler (the FLIP measure and the decoder of meshopt are built from C++).
packages="libvulkan1 mesa-vulkan-drivers libx11-6 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libxkbcommon0 libxkbcommon-x11-0 libwayland-client0 xvfb xdotool gcc g++ libc6-dev"

if ! command -v dpkg-query >/dev/null 2>&1 || ! command -v apt-get >/dev/null 2>&1; then
    echo "setup.sh knows Debian and Ubuntu only; here please install: a Vulkan driver and loader, the X11 or Wayland client libraries with xkbcommon, a C linker, and for the tests Mesa's lavapipe, Xvfb and xdotool."
    exit 0
fi

missing=""
for package in $packages; do
    status=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
    [ "$status" = "install ok installed" ] || missing="$missing $package"
done
as_root=""
if [ "$(id -u)" -ne 0 ]; then
    as_root="sudo"
fi
if [ -n "$missing" ]; then
    if [ -n "$as_root" ] && ! command -v sudo >/dev/null 2>&1; then
        echo "setup.sh needs root to install them; run as root: apt-get install$missing" >&2
        exit 1
    fi
    echo "Installing:$missing"
    $as_root apt-get update -q
    # shellcheck disable=SC2086
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing
fi

swiftshader="target/swiftshader"
if [ "${1:-}" = "--second-driver" ] && [ ! -e "$swiftshader/vk_swiftshader_icd.json" ]; then
    # Debian builds it as a part of Chromium, of which nothing else is needed or installed.
    cd "$(dirname "$0")"
    mkdir -p "$swiftshader"
    (
        cd "$swiftshader"
        apt-get download -q chromium-common || { $as_root apt-get update -q && apt-get download -q chromium-common; }
        for file in libvk_swiftshader.so vk_swiftshader_icd.json; do
            dpkg-deb --fsys-tarfile chromium-common_*.deb | tar -x --strip-components=4 "./usr/lib/chromium/$file"
        done
        rm chromium-common_*.deb
    )
fi
