# shellcheck shell=sh
# ./upswing python: a virtual environment with the package upswing. Read by ./upswing, whose functions
# it uses.
: "${root:?}" "${setup:?}" "${packages:?}"

python_venv=$root/build/python-venv

python_usage() {
  cat <<'END_OF_USAGE'
Usage: ./upswing python [ARGUMENTS]

Runs Python with the package upswing, in the virtual environment build/python-venv. Creates the
environment and builds the package if they are missing. ARGUMENTS go to Python.

Examples:
  ./upswing python                                     start a prompt, then: import upswing
  ./upswing python -c 'import upswing; print(upswing.train(agent="fast", seed=1))'
  ./upswing python -m pip install stable-baselines3    add a package to the environment
  ./upswing python examples/python/sb3_sac.py
END_OF_USAGE
}

# Makes the virtual environment, which has the package as it is built.
make_python_venv() {
  make_venv Python "$python_venv" tools/python-requirements.txt "$root/build/release/python"
}

# Lets the release build have the package too.
configure_python() {
  cache=build/release/CMakeCache.txt
  grep -q '^UPSWING_PYTHON:BOOL=ON$' "$cache" 2>/dev/null &&
    grep -qF "Python_EXECUTABLE:UNINITIALIZED=$python_venv/bin/python" "$cache" && return
  say "configuring build/release with the Python package"
  cmake --preset release -DUPSWING_PYTHON=ON -DPython_EXECUTABLE="$python_venv/bin/python" \
    >build/configure-release.log || fail "could not configure (see above, and" \
    "build/configure-release.log)"
}

# Installs what the package needs and readies the build for it.
set_up_python() {
  packages="$packages python3-dev" # the headers for the module
  # shellcheck disable=SC2086  # a list of words
  (install_packages $packages && lock && make_python_venv && configure_python) </dev/null || exit 1
}

run_python() {
  case ${1:-} in
    -h | --help)
      python_usage
      exit 0
      ;;
  esac
  if [ "$setup" = yes ]; then
    set_up_python
    set_up release upswing_package
  fi
  [ -x "$python_venv/bin/python" ] && [ -f "$root/build/release/python/upswing/__init__.py" ] ||
    fail "the Python package is not built: run ./upswing python once without --no-setup, as a user" \
      "who may write to $root"
  exec "$python_venv/bin/python" "$@"
}
