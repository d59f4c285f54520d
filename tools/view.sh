# shellcheck shell=sh
# ./upswing view: a virtual environment with MuJoCo's viewer. Read by ./upswing, whose functions it uses.
: "${root:?}" "${setup:?}" "${packages:?}" "${python:?}"

# set_up_view ARGUMENTS: installs the libraries and Python packages that draw, unless ARGUMENTS ask for help,
# and names the Python to the program. UPSWING_PYTHON names another one.
set_up_view() {
  [ -z "${UPSWING_PYTHON:-}" ] || return 0
  for word; do
    case $word in -h | --help) return 0 ;; esac
  done
  venv=$root/build/view-venv
  packages="$packages libegl1 libgl1 libgl1-mesa-dri"
  if [ "$setup" = yes ]; then
    # shellcheck disable=SC2086  # a list of words
    (install_packages $packages && lock && make_venv view "$venv" tools/view-requirements.txt) \
      </dev/null || exit 1
  fi
  [ ! -x "$venv/bin/python" ] || export UPSWING_PYTHON="$venv/bin/python"
}
