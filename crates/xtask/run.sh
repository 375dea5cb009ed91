#!/usr/bin/env bash
# Installs a linker and the pinned Rust toolchain, then runs `cargo xtask "$@"`.
# `npm start`, `npm test` and the scripts of package.json call this script.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

# Debian packages, as "command package...". They are installed only if the command is missing.
debian_packages=(
  "cc gcc libc6-dev"
  "clang clang"
)

missing=()
for row in "${debian_packages[@]}"; do
  read -r command packages <<<"$row"
  command -v "$command" >/dev/null || missing+=($packages)
done
# Prints the path of the first of these commands that is installed.
first_of() { command -v "$@" | head -n 1; }
# Tests of the page use an installed Chromium or Chrome, or else Debian's Chromium, and Mesa's software OpenGL.
if [[ " test test-all page-test npm " == *" ${1:-} "* ]]; then
  export CHROMIUM=${CHROMIUM:-$(first_of chromium google-chrome || true)}
  if [ -z "$CHROMIUM" ]; then
    missing+=(chromium)
    CHROMIUM=/usr/bin/chromium
  fi
  compgen -G "/usr/lib/*/libEGL_mesa.so.0" >/dev/null || missing+=(libegl1 libgl1-mesa-dri)
fi
# Tests in Firefox use the one that is installed, or else Debian's, and need a virtual screen.
if [ "${1:-}" = test-all ]; then
  export FIREFOX=${FIREFOX:-$(first_of firefox-esr firefox || true)}
  if [ -z "$FIREFOX" ]; then
    missing+=(firefox-esr)
    FIREFOX=/usr/bin/firefox-esr
  fi
  command -v Xvfb >/dev/null || missing+=(xvfb)
fi
# Tests of the kernels need a Vulkan device, for example Mesa's software device.
if [[ " test test-all " == *" ${1:-} "* ]]; then
  compgen -G "/usr/lib/*/libvulkan.so.1" >/dev/null || missing+=(libvulkan1)
  compgen -G "/usr/share/vulkan/icd.d/*.json" >/dev/null || missing+=(mesa-vulkan-drivers)
fi
# The Python package is built and tested in a virtual environment.
if [[ " test-all test-long python wheel " == *" ${1:-} "* ]]; then
  python3 -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)
fi
if ((${#missing[@]})); then
  as_root=()
  if [ "$(id -u)" != 0 ]; then as_root=(sudo); fi
  if ! command -v apt-get >/dev/null || { ((${#as_root[@]})) && ! command -v sudo >/dev/null; }; then
    echo "error: ${missing[*]} is missing and cannot be installed from here: install it, then try again" >&2
    exit 1
  fi
  echo "setup: installing ${missing[*]} (apt-get)"
  "${as_root[@]}" apt-get update -qq
  DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi

# rustup installs cargo in this folder, which only login shells have in their PATH.
if ! command -v cargo >/dev/null && [ -x "${CARGO_HOME:-$HOME/.cargo}/bin/cargo" ]; then
  export PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
fi
if ! command -v cargo >/dev/null; then
  cat >&2 <<'TXT'
error: Rust is missing. Install rustup, then try again:
  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y --profile minimal
(on Debian 13 and later also: apt-get install rustup)
TXT
  exit 1
fi
if command -v rustup >/dev/null; then
  # rust-toolchain.toml names the version, the wasm32 target, rustfmt and clippy.
  channel=$(sed -n 's/^channel = "\(.*\)"/\1/p' rust-toolchain.toml)
  if ! rustup run "$channel" rustc --version >/dev/null 2>&1; then
    echo "setup: installing Rust $channel (rustup)"
    rustup toolchain install "$channel" --profile minimal
  fi
  if ! rustup target list --toolchain "$channel" --installed | grep -qx wasm32-unknown-unknown; then
    echo "setup: installing Rust's wasm32-unknown-unknown target (rustup)"
    rustup target add --toolchain "$channel" wasm32-unknown-unknown
  fi
fi

exec cargo xtask "$@"
