#!/bin/sh
# Installs lavapipe, Mesa's Vulkan driver for the processor, on Debian and Ubuntu, so that the GPU
# engine and its tests run on a machine without a GPU. Does nothing where a Vulkan driver is there.
set -eu

# The loader and at least one driver's manifest, in the folders where the loader looks.
have_driver() {
    { ldconfig -p 2>/dev/null || /sbin/ldconfig -p; } 2>/dev/null | grep -q 'libvulkan\.so\.1' || return 1
    [ -n "${VK_ICD_FILENAMES:-}${VK_DRIVER_FILES:-}" ] && return 0
    for manifest in /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json \
        /usr/local/share/vulkan/icd.d/*.json; do
        if [ -f "$manifest" ]; then return 0; fi
    done
    return 1
}

if [ "$(uname -s)" != Linux ]; then
    echo "install-lavapipe: not Linux; macOS has Metal and Windows has DX12, nothing to install"
    exit 0
fi
if have_driver; then
    echo "install-lavapipe: a Vulkan driver is there, nothing to install"
    exit 0
fi
if ! command -v apt-get >/dev/null; then
    echo "install-lavapipe: no apt-get here; install Mesa's Vulkan drivers and the Vulkan loader" \
        "with this system's own package manager" >&2
    exit 1
fi
sudo=
if [ "$(id -u)" -ne 0 ]; then sudo=sudo; fi
$sudo apt-get -q update
$sudo env DEBIAN_FRONTEND=noninteractive apt-get -q install -y mesa-vulkan-drivers libvulkan1
have_driver || {
    echo "install-lavapipe: installed, but no Vulkan driver manifest appeared" >&2
    exit 1
}
