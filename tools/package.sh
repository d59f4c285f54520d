# shellcheck shell=sh
# ./upswing package: builds packages for people without a compiler. Read by ./upswing, whose functions it
# uses, after tools/web.sh, tools/demo.sh and tools/docs.sh.
: "${root:?}" "${setup:?}" "${packages:?}" "${python:?}"

package_usage() {
  cat <<'END_OF_USAGE'
Usage: ./upswing package [KIND...] [--arch ARCH] [--out FOLDER] [--allow-changes]

Builds packages of the last commit: the same commit gives the same bits. Installs what it needs. Build on
Debian 12, whose glibc is the oldest that the packages then run with.

  KIND             tarball, deb or wheels; default: all three. windows: a zip archive for 64-bit Windows,
                   which is cross-compiled; no other kind with it
  --arch ARCH      x86-64 (default) or arm64, which is cross-compiled. Build the x86-64 wheels before
                   the arm64 wheels
  --out FOLDER     folder for the packages and their checksums (default build/packages)
  --allow-changes  build with uncommitted changes, too

There is a wheel for Python 3.11 and one for Python 3.12 and later, each built where such a Python with
headers is on the PATH. Debian 12 has only Python 3.11.

Examples:
  ./upswing package
  ./upswing package tarball --arch arm64
  ./upswing package windows
END_OF_USAGE
}

deb_packages="help2man lintian git"
arm64_packages="g++-aarch64-linux-gnu qemu-user libhwy-dev:arm64 libfmt-dev:arm64 \
libtomlplusplus-dev:arm64 libprotobuf-dev:arm64 zlib1g-dev:arm64 \
libmuparser-dev:arm64 libpython3-dev:arm64"

package() {
  arch=x86-64 out='' changes='' kinds=''
  while [ $# -gt 0 ]; do
    case $1 in
      -h | --help) package_usage; exit 0 ;;
      --arch=*) arch=${1#*=} ;;
      --out=*) out=${1#*=} ;;
      --arch | --out)
        [ $# -gt 1 ] || bad_input "$1: expected a value, got none"
        case $1 in --arch) arch=$2 ;; *) out=$2 ;; esac
        shift
        ;;
      --allow-changes) changes=$1 ;;
      tarball | deb | wheels | windows) kinds="$kinds $1" ;;
      -*) bad_input "unknown flag $1 (see ./upswing package --help)" ;;
      *) bad_input "expected tarball, deb, wheels or windows, got \"$1\"" ;;
    esac
    shift
  done
  case $arch in
    x86-64 | arm64) ;;
    *) bad_input "--arch: expected x86-64 or arm64, got \"$arch\"" ;;
  esac
  case $kinds:$arch in
    " windows:x86-64") arch=windows kinds=zip ;;
    *windows*) bad_input "expected windows without another kind or --arch, got$kinds --arch $arch" ;;
  esac
  [ "$setup" = yes ] || bad_input "expected ./upswing package without --no-setup"
  [ "$(uname -m)" = x86_64 ] || bad_input "expected an x86-64 machine, got $(uname -m)"

  packages="$packages $deb_packages python3-dev"
  # Check before a build of ten minutes.
  # shellcheck disable=SC2086  # lists of words
  (install_packages $packages && cd "$root" &&
    exec "$python" -B tools/package/package.py $kinds --check $changes) </dev/null || exit 2
  set_up_docs
  # shellcheck disable=SC2046  # a list of words
  set_up release upswing $(extra_programs)
  rm -rf "$root/build/docs-work" "$docs" # an earlier build leaves pages and words of the index
  build_docs
  build_demo
  [ "$arch" != arm64 ] || set_up_arm64
  [ "$arch" != windows ] || set_up_windows
  set_up_package
  # shellcheck disable=SC2086  # a list of words
  (lock && exec "$root/build/package/venv/bin/python" -B tools/package/package.py $kinds \
    --arch "$arch" ${out:+--out "$out"} $changes) </dev/null
}

# Installs the tools for the SBOM and the wheels.
set_up_package() {
  (lock && make_venv "packages" "$root/build/package/venv" tools/package/requirements.txt) \
    </dev/null || exit 1
}

# Cross-compiles the program for Windows.
set_up_windows() {
  # shellcheck disable=SC2046,SC2086  # lists of words
  (install_packages $windows_packages && build windows upswing $(extra_programs)) </dev/null || exit 1
}

# Cross-compiles the program for 64-bit Arm.
set_up_arm64() {
  # shellcheck disable=SC2086  # a list of words
  (
    case $(dpkg --print-foreign-architectures) in
      *arm64*) ;;
      *) [ "$(id -u)" != 0 ] || dpkg --add-architecture arm64 ;;
    esac
    install_packages $arm64_packages
    # shellcheck disable=SC2046  # a list of words
    build arm64 upswing $(extra_programs)
  ) </dev/null || exit 1
}
