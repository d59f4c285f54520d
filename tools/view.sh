# shellcheck shell=sh
# ./upswing view and ./upswing plant: a virtual environment with MuJoCo and its viewer. Read by ./upswing,
# whose functions it uses.
: "${root:?}" "${setup:?}" "${packages:?}" "${python:?}"

# set_up_view ARGUMENTS: installs the libraries and Python packages that draw, unless ARGUMENTS ask for help,
# and names the Python to the program. `plant` draws nothing and needs no libraries. UPSWING_PYTHON names
# another Python.
set_up_view() {
  [ -z "${UPSWING_PYTHON:-}" ] || return 0
  for word; do
    case $word in -h | --help) return 0 ;; esac
  done
  venv=$root/build/view-venv
  [ "${command:-}" = plant ] || packages="$packages libegl1 libgl1 libgl1-mesa-dri"
  if [ "$setup" = yes ]; then
    # shellcheck disable=SC2086  # a list of words
    (install_packages $packages && lock && make_venv view "$venv" tools/view-requirements.txt) \
      </dev/null || exit 1
  fi
  [ ! -x "$venv/bin/python" ] || export UPSWING_PYTHON="$venv/bin/python"
}
